//! Spectra as written in a file.

/// A spectrum or colour before anything is known about the channels it is rendered in.
#[derive(Clone, Debug, PartialEq)]
pub enum SpectrumValue {
    /// The same at every wavelength.
    Uniform(f64),
    /// Linear red, green and blue.
    Rgb([f64; 3]),
    /// Pairs of wavelength (nm, increasing) and value.
    Sampled(Vec<(f64, f64)>),
}

impl SpectrumValue {
    /// Every number of the spectrum, without wavelengths: for range checks.
    pub fn values(&self) -> Vec<f64> {
        match self {
            SpectrumValue::Uniform(v) => vec![*v],
            SpectrumValue::Rgb(rgb) => rgb.to_vec(),
            SpectrumValue::Sampled(pairs) => pairs.iter().map(|(_, v)| *v).collect(),
        }
    }
}
