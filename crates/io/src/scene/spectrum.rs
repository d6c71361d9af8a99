//! Spectra as written in a file.

/// A spectrum or colour, before the channels of the render are known.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumValue {
    /// A plain number, for every channel.
    Uniform(f64),
    /// Equal energy: a constant over wavelength. As light on a colour film it is not white.
    EqualEnergy(f64),
    /// Linear red, green and blue.
    Rgb([f64; 3]),
    /// Pairs of wavelength (nm, increasing) and value.
    Sampled(Vec<(f64, f64)>),
    /// File of pairs of wavelength and value, by its name in the scene.
    File(String),
    /// Daylight (illuminant D65) with this luminance.
    D65(f64),
    /// Thermal radiation.
    Blackbody {
        /// Temperature in kelvin.
        temperature: f64,
        /// A factor.
        scale: f64,
        /// Wavelengths in nm outside which the radiation is zero.
        range: [f64; 2],
    },
}

impl SpectrumValue {
    /// Returns every number that the spectrum states, except wavelengths, for range checks.
    pub fn values(&self) -> Vec<f64> {
        match self {
            SpectrumValue::Uniform(v) | SpectrumValue::EqualEnergy(v) | SpectrumValue::D65(v) => {
                vec![*v]
            }
            SpectrumValue::Rgb(rgb) => rgb.to_vec(),
            SpectrumValue::Sampled(pairs) => pairs.iter().map(|(_, v)| *v).collect(),
            SpectrumValue::Blackbody { scale, .. } => vec![*scale],
            SpectrumValue::File(_) => Vec::new(),
        }
    }
}
