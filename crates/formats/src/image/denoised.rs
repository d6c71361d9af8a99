//! Denoised images, which are not estimates: what a denoiser needs of an image, and what is kept of its answer.
//!
//! A denoiser trades noise for bias that nobody knows. What it made of an image is in layers with names of their own, never in
//! the main layer, beside how far it moved each value in terms of the standard error.

use super::exposure::Exposure;
use super::{ImageLayers, Layer, RgbImage};
use crate::error::Problem;

/// The attribute of denoised images, which says what denoised them.
pub const DENOISED: &str = "denoised";
/// The layer with the denoised values.
pub const LAYER: &str = "denoised";
/// The layer with (denoised − estimate) / standard error.
pub const DIFFERENCE: &str = "difference";
/// Names of layers that guide denoisers, those to be preferred first.
pub const ALBEDOS: [&str; 1] = ["albedo"];
/// As [`ALBEDOS`], of normals.
pub const NORMALS: [&str; 2] = ["sh_normal", "geo_normal"];

/// Channels that are denoised together.
const COLOURS: [&str; 3] = ["R", "G", "B"];
/// Attributes that hold for the estimate only.
const OF_ESTIMATES: [&str; 1] = ["trust"];
/// Beyond so many standard errors noise hardly explains a difference.
const FAR: f64 = 3.0;

/// An image as a denoiser takes it: colours around 1, and what to undo afterwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Noisy {
    /// The channels that its red, green and blue are: three, or one that is all of them.
    pub channels: Vec<String>,
    /// Values times `gain`.
    pub image: RgbImage,
    /// A power of two.
    gain: f32,
}

/// A denoised image.
#[derive(Clone, Debug, PartialEq)]
pub struct Denoised {
    /// With the layers [`LAYER`] and, if standard errors are known, [`DIFFERENCE`].
    pub image: ImageLayers,
    /// Where the denoiser moved values.
    pub moved: Option<Moved>,
}

/// How far a denoiser moved values, in terms of their standard errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moved {
    /// Share of the values with a standard error that it moved by more than three of them. 0.0027 of the values of an estimate
    /// are so far from the truth, if its noise is normal.
    pub beyond_three: f64,
    /// Share of the values that it moved but that have no standard error, as where no sample found light.
    pub unknown: f64,
}

impl ImageLayers {
    /// Red, green and blue, or X, Y and Z, of a layer that is to guide a denoiser.
    pub fn guide(&self, layer: &str) -> Option<RgbImage> {
        let layer = self.layer(layer)?;
        let of = |names: [&str; 3]| {
            let [a, b, c] = names.map(|name| layer.channel(name));
            Some([a?, b?, c?])
        };
        let planes = of(COLOURS).or_else(|| of(["X", "Y", "Z"]))?;
        Some(self.joined(planes, 1.0))
    }

    /// The main layer as a denoiser takes it: red, green and blue together, every other channel on its own.
    ///
    /// # Errors
    ///
    /// No main layer, and values that are not finite.
    pub fn noisy(&self) -> Result<Vec<Noisy>, Problem> {
        let none = || Problem::Empty("the image has no main layer".into());
        let main = self.layer("").ok_or_else(none)?;
        for (name, values) in &main.channels {
            if let Some(i) = values.iter().position(|v| !v.is_finite()) {
                let [x, y] = [i % self.width, i / self.width];
                return Err(Problem::NotFinite {
                    place: format!("pixel ({x}, {y}) of channel {name}"),
                    value: values[i].into(),
                });
            }
        }
        let mut parts = Vec::new();
        let mut others: Vec<&(String, Vec<f32>)> = main.channels.iter().collect();
        if let [Some(r), Some(g), Some(b)] = COLOURS.map(|name| main.channel(name)) {
            parts.push((COLOURS.map(str::to_owned).to_vec(), [r, g, b]));
            others.retain(|(name, _)| !COLOURS.contains(&name.as_str()));
        }
        for (name, values) in others {
            parts.push((vec![name.clone()], [values; 3]));
        }
        let noisy = |(channels, planes): (_, [&[f32]; 3])| {
            // Denoisers take very small radiances for black.
            let stops = Exposure::of(self.joined(planes, 1.0).pixels.into_iter());
            let gain = stops.round().clamp(-126.0, 126.0).exp2() as f32;
            Noisy {
                channels,
                image: self.joined(planes, gain),
                gain,
            }
        };
        Ok(parts.into_iter().map(noisy).collect())
    }

    fn joined(&self, planes: [&[f32]; 3], gain: f32) -> RgbImage {
        let pixel = |i: usize| planes.map(|plane| plane[i] * gain);
        RgbImage {
            width: self.width,
            height: self.height,
            pixels: (0..self.width * self.height).map(pixel).collect(),
        }
    }

    /// What a denoiser made of this image: its answers to [`ImageLayers::noisy`], in that order. `by` says what it is and which
    /// guides it had.
    ///
    /// # Errors
    ///
    /// Answers of another size, and values that are not finite.
    pub fn denoised(&self, answers: &[(Noisy, RgbImage)], by: &str) -> Result<Denoised, Problem> {
        let mut denoised = layer(LAYER);
        for (noisy, answer) in answers {
            answer.check_finite()?;
            if [answer.width, answer.height] != [self.width, self.height] {
                return Err(Problem::Mismatch {
                    expected: format!("{} x {} pixels", self.width, self.height),
                    found: format!("{} x {}", answer.width, answer.height),
                });
            }
            denoised.channels.extend(noisy.planes(answer));
        }
        let mut counts = Counts::default();
        let variance = self.layer("variance");
        let differences = denoised.channels.iter().map(|(name, values)| {
            let estimate = self.layer("")?.channel(name)?;
            let variance = variance?.channel(name)?;
            let of = |i: usize| counts.take(values[i], estimate[i], variance[i]);
            Some((name.clone(), (0..values.len()).map(of).collect()))
        });
        let differences: Option<Vec<_>> = differences.collect();
        let attributes = self.attributes.iter();
        let attributes = attributes.filter(|(name, _)| !OF_ESTIMATES.contains(&name.as_str()));
        let mut image = ImageLayers {
            width: self.width,
            height: self.height,
            layers: vec![denoised],
            attributes: attributes.cloned().collect(),
        };
        image.attributes.push((DENOISED.into(), by.into()));
        let moved = differences.map(|channels| {
            image.layers.push(Layer {
                channels,
                ..layer(DIFFERENCE)
            });
            counts.moved()
        });
        Ok(Denoised { image, moved })
    }
}

impl Noisy {
    /// The channels in a denoiser's answer.
    fn planes(&self, answer: &RgbImage) -> Vec<(String, Vec<f32>)> {
        let plane = |of: &dyn Fn(&[f32; 3]) -> f32| {
            let values = answer.pixels.iter().map(|pixel| of(pixel) / self.gain);
            values.collect()
        };
        match &self.channels[..] {
            [grey] => vec![(grey.clone(), plane(&|[r, g, b]| (r + g + b) / 3.0))],
            channels => {
                let channels = channels.iter().enumerate();
                channels
                    .map(|(c, name)| (name.clone(), plane(&|pixel| pixel[c])))
                    .collect()
            }
        }
    }
}

fn layer(name: &str) -> Layer {
    Layer {
        name: name.into(),
        channels: Vec::new(),
    }
}

/// Values that were counted.
#[derive(Debug, Default)]
struct Counts {
    all: usize,
    known: usize,
    far: usize,
}

impl Counts {
    /// The difference of a value from its estimate by the standard error; NaN if it was moved but has none.
    fn take(&mut self, denoised: f32, estimate: f32, variance: f32) -> f32 {
        let difference = f64::from(denoised) - f64::from(estimate);
        let error = f64::from(variance).sqrt();
        self.all += 1;
        let z = if difference == 0.0 {
            0.0
        } else if error > 0.0 && error.is_finite() {
            difference / error
        } else {
            return f32::NAN;
        };
        self.known += 1;
        self.far += usize::from(z.abs() > FAR);
        z as f32
    }

    fn moved(&self) -> Moved {
        Moved {
            beyond_three: self.far as f64 / self.known.max(1) as f64,
            unknown: (self.all - self.known) as f64 / self.all.max(1) as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(channels: &[(&str, [f32; 4])], variance: Option<f32>) -> ImageLayers {
        let of = |name: &str, values: &dyn Fn(usize, usize) -> f32| Layer {
            name: name.into(),
            channels: (channels.iter().enumerate())
                .map(|(c, (n, _))| ((*n).into(), (0..4).map(|i| values(c, i)).collect()))
                .collect(),
        };
        let mut layers = vec![of("", &|c, i| channels[c].1[i])];
        layers.extend(variance.map(|v| of("variance", &|_, i| if i == 3 { 0.0 } else { v })));
        ImageLayers {
            width: 2,
            height: 2,
            layers,
            attributes: vec![("seed".into(), "7".into()), ("trust".into(), "{}".into())],
        }
    }

    /// A denoiser that adds `shift` to what it is given.
    fn shifted(image: &ImageLayers, shift: f32) -> Denoised {
        let answer = |noisy: Noisy| {
            let mut shown = noisy.image.clone();
            let by = shift * noisy.gain;
            shown.pixels.iter_mut().flatten().for_each(|v| *v += by);
            (noisy, shown)
        };
        let answers: Vec<_> = image.noisy().unwrap().into_iter().map(answer).collect();
        image.denoised(&answers, "a test").unwrap()
    }

    /// Standard errors of 0.25 and a shift of 1: four everywhere, but where none is known.
    #[test]
    fn differences_are_in_standard_errors() {
        let noisy = image(
            &[("G", [1.0; 4]), ("B", [4.0; 4]), ("R", [2.0; 4])],
            Some(0.0625),
        );
        let found = shifted(&noisy, 1.0);
        let [values, difference] = [LAYER, DIFFERENCE].map(|name| found.image.layer(name).unwrap());
        for (name, value) in [("R", 3.0), ("G", 2.0), ("B", 5.0)] {
            assert_eq!(values.channel(name), Some(&[value; 4][..]), "{name}");
            let z = difference.channel(name).unwrap();
            assert_eq!(z[..3], [4.0; 3]);
            assert!(z[3].is_nan());
        }
        let moved = found.moved.unwrap();
        assert_eq!((moved.beyond_three, moved.unknown), (1.0, 0.25));
        let still = shifted(&noisy, 0.0).moved.unwrap();
        assert_eq!((still.beyond_three, still.unknown), (0.0, 0.0));
        assert_eq!(shifted(&noisy, 0.5).moved.unwrap().beyond_three, 0.0);
    }

    #[test]
    fn a_denoised_image_is_no_estimate() {
        let found = shifted(&image(&[("Y", [1e-9; 4])], None), 1e-9);
        assert!(found.image.layer("").is_none() && found.image.layer(DIFFERENCE).is_none());
        assert_eq!(found.moved, None);
        assert_eq!(found.image.attribute(DENOISED), Some("a test"));
        assert_eq!(found.image.attribute("seed"), Some("7"));
        assert_eq!(found.image.attribute("trust"), None);
        let values = found.image.layer(LAYER).unwrap().channel("Y").unwrap();
        assert!((values[0] / 2e-9 - 1.0).abs() < 1e-6, "{values:?}");
    }

    /// Watts per wavelength may be 1e-20, which a denoiser would take for black.
    #[test]
    fn denoisers_see_values_around_one() {
        let noisy = image(&[("550nm", [1e-20; 4]), ("600nm", [3e7; 4])], None);
        for part in noisy.noisy().unwrap() {
            let value = part.image.pixels[0][1];
            assert!((0.3..1.5).contains(&value), "{}: {value}", part.channels[0]);
        }
        let mut broken = noisy;
        broken.layers[0].channels[1].1[2] = f32::NAN;
        let message = broken.noisy().unwrap_err().to_string();
        assert!(
            message.contains("pixel (0, 1) of channel 600nm"),
            "{message}"
        );
    }
}
