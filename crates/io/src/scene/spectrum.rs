//! Spectra as written in a file.

/// A spectrum or colour before anything is known about the channels it is rendered in.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumValue {
    /// A plain number: the same in every channel.
    Uniform(f64),
    /// The same at every wavelength: as light on a colour film it is not white.
    EqualEnergy(f64),
    /// Linear red, green and blue.
    Rgb([f64; 3]),
    /// Pairs of wavelength (nm, increasing) and value.
    Sampled(Vec<(f64, f64)>),
    /// A file of such pairs, as the scene writes its name.
    File(String),
    /// Daylight, the illuminant D65, of this luminance.
    D65(f64),
    /// Thermal radiation.
    Blackbody {
        /// In kelvin.
        temperature: f64,
        /// A factor.
        scale: f64,
        /// Wavelengths in nm beyond which there is none.
        range: [f64; 2],
    },
}

impl SpectrumValue {
    /// Every number that the spectrum states, without wavelengths: for range checks.
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
