//! Spectral channels: luminance, RGB, or any list of wavelengths.

use super::colour::{self, Seen, at, luminance};
use super::described::{diffracts, disperses, fluoresces, is_meter};
use super::texture_role::Role;
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::scene::{ObjectDescription, PluginKind, SpectrumValue, Value, descendants};
use transport::Spectrum;

/// Channels of the film.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Channels {
    /// Luminance, one channel.
    Luminance,
    /// Red, green and blue.
    Rgb,
    /// List of wavelengths.
    Wavelengths {
        /// Wavelengths in nm.
        nm: Vec<f64>,
        /// True if each wavelength has its own paths, because an index or the diffraction at the
        /// aperture depends on the wavelength, or because a medium fluoresces.
        apart: bool,
    },
}

impl Channels {
    /// Returns the channels of the film of the scene's first sensor, which may belong to a shape.
    /// Without a film, cameras have red, green and blue, and meters have luminance.
    pub(super) fn of(root: &ObjectDescription, diagnostics: &mut Diagnostics) -> Self {
        fn children(
            o: &ObjectDescription,
            kind: PluginKind,
        ) -> impl Iterator<Item = &ObjectDescription> {
            let children = o.children.iter().map(|c| &*c.object);
            children.filter(move |c| c.kind == kind)
        }
        let of_shapes =
            children(root, PluginKind::Shape).flat_map(|s| children(s, PluginKind::Sensor));
        let first = children(root, PluginKind::Sensor).chain(of_shapes).next();
        let film = first.and_then(|s| children(s, PluginKind::Film).next());
        let Some(film) = film else {
            return match first {
                Some(sensor) if is_meter(sensor) => Channels::Luminance,
                _ => Channels::Rgb,
            };
        };
        let depends = |object: &ObjectDescription| disperses(object) || fluoresces(object);
        let apart = descendants(seen(root)).any(depends) || first.is_some_and(diffracts);
        let channels = Channels::of_film(film, diagnostics);
        if apart { channels.apart() } else { channels }
    }

    /// Returns the channels that a film describes. After an error the film has one default
    /// wavelength, so that dependent parts report no further errors.
    pub(super) fn of_film(film: &ObjectDescription, diagnostics: &mut Diagnostics) -> Self {
        let text = |name: &str| {
            let property = film.properties.iter().find(|p| p.name == name)?;
            match &property.value {
                Value::String(text) => Some((text.as_str(), &property.location)),
                _ => None,
            }
        };
        match text("pixel_format").map(|(format, _)| format) {
            Some("luminance") => return Channels::Luminance,
            Some("spectral") => {}
            _ => return Channels::Rgb,
        }
        let nm = match text("wavelengths") {
            Some((list, location)) => wavelengths(list).unwrap_or_else(|| {
                let message = "'wavelengths': expected positive numbers in nanometres";
                diagnostics.push(Diagnostic::error(message).at(location));
                vec![GREEN]
            }),
            None => {
                let message = "a spectral film needs 'wavelengths'";
                let help = "for example \"450, 550, 650\", in nanometres".to_owned();
                diagnostics.push(Diagnostic::error(message).help(help).at(&film.location));
                vec![GREEN]
            }
        };
        Channels::Wavelengths { nm, apart: false }
    }

    /// Returns the single channel in which quantities other than light are shown: luminance, or the
    /// only wavelength. Reports an error if there are several wavelengths.
    pub(super) fn single(self, diagnostics: &mut Diagnostics) -> Self {
        match self {
            Channels::Wavelengths { mut nm, apart } if nm.len() > 1 => {
                let message =
                    "the integrator 'aov' follows rays of one wavelength, the film has several";
                let help = "list one in the film's 'wavelengths'".to_owned();
                diagnostics.push(Diagnostic::error(message).help(help));
                nm.truncate(1);
                Channels::Wavelengths { nm, apart }
            }
            Channels::Wavelengths { .. } => self,
            Channels::Luminance | Channels::Rgb => Channels::Luminance,
        }
    }

    /// Gives each wavelength its own paths.
    pub(super) fn apart(self) -> Self {
        match self {
            Channels::Wavelengths { nm, .. } => Channels::Wavelengths { nm, apart: true },
            others => others,
        }
    }

    /// Returns the number of channels.
    pub(super) fn count(&self) -> usize {
        match self {
            Channels::Luminance => 1,
            Channels::Rgb => 3,
            Channels::Wavelengths { nm, .. } => nm.len(),
        }
    }

    /// Returns the number of groups that are rendered separately.
    pub(super) fn groups(&self) -> usize {
        self.count().div_ceil(self.group_size())
    }

    /// Returns the number of channels that share their paths.
    pub(super) fn group_size(&self) -> usize {
        match self {
            Channels::Wavelengths { apart: true, .. } => 1,
            _ => Spectrum::CHANNELS,
        }
    }

    /// Returns the number of the first channel of a group.
    pub(super) fn first(&self, group: usize) -> usize {
        group * self.group_size()
    }

    /// Returns the wavelength of a group in nm, if the group has just one.
    pub(super) fn wavelength(&self, group: usize) -> Option<f64> {
        match self {
            Channels::Wavelengths { nm, .. } if self.channels_of(group) == 1 => {
                // Planted error "every wavelength refracted as the first", found by morgana-io/io::dispersion::a_glass_ball_deflects_each_wavelength_by_snells_law:
                // Some(nm[0])
                Some(nm[self.first(group)])
            }
            _ => None,
        }
    }

    /// Returns the wavelengths of a group in nm, if channels are wavelengths.
    pub(super) fn wavelengths(&self, group: usize) -> Option<&[f64]> {
        match self {
            Channels::Wavelengths { nm, .. } => {
                let first = self.first(group);
                Some(&nm[first..first + self.channels_of(group)])
            }
            _ => None,
        }
    }

    /// Returns the number of channels in a group.
    pub(super) fn channels_of(&self, group: usize) -> usize {
        (self.count() - self.first(group)).min(self.group_size())
    }

    /// Converts a spectrum in a role to the film's kind of channels, before it is divided into
    /// groups.
    pub(super) fn seen(&self, value: &SpectrumValue, role: Role) -> Result<Seen, String> {
        match (self, value) {
            (Channels::Wavelengths { .. }, SpectrumValue::Rgb(_)) if role.is_number() => {
                colour::seen(value, role)
            }
            (Channels::Wavelengths { .. }, value) => Ok(Seen {
                value: value.clone(),
                clipped: None,
            }),
            (Channels::Luminance, SpectrumValue::EqualEnergy(v)) => Ok(Seen {
                value: SpectrumValue::Uniform(*v),
                clipped: None,
            }),
            (_, value) => colour::seen(value, role),
        }
    }

    /// Returns the names of the channels, as in image files.
    pub(super) fn names(&self) -> Vec<String> {
        match self {
            Channels::Luminance => vec!["Y".into()],
            Channels::Rgb => ["R", "G", "B"].map(String::from).into(),
            Channels::Wavelengths { nm, .. } => nm.iter().map(|nm| format!("{nm}nm")).collect(),
        }
    }

    /// Returns a spectrum in the channels of a group. A film of colours or luminance accepts only a
    /// colour or a number.
    pub(super) fn spectrum(&self, value: &SpectrumValue, group: usize) -> Result<Spectrum, String> {
        let channels = self.channels_of(group);
        let all = |f: &dyn Fn(usize) -> f64| {
            Spectrum(std::array::from_fn(
                |c| if c < channels { f(c) } else { 0.0 },
            ))
        };
        match (self, value) {
            (Channels::Rgb, SpectrumValue::Rgb(rgb)) => Ok(all(&|c| rgb[c])),
            (Channels::Luminance, SpectrumValue::Rgb(rgb)) => {
                let y = luminance(*rgb);
                Ok(all(&|_| y))
            }
            (Channels::Wavelengths { nm, .. }, value) => {
                let first = self.first(group);
                let values = (0..channels).map(|c| at(value, nm[first + c]));
                let values: Option<Vec<f64>> = values.collect();
                let values = values.ok_or(
                    "an RGB value has no meaning on a spectral film; use a spectrum of \
                     wavelength:value pairs, or one number",
                )?;
                Ok(all(&|c| values[c]))
            }
            (_, SpectrumValue::Uniform(v)) => Ok(all(&|_| *v)),
            _ => Err("a spectrum that has not become a colour yet".to_owned()),
        }
    }
}

/// Returns the objects of the scene that light can reach: shapes, sensors and emitters. Media and
/// volumes to which nothing refers do not count.
fn seen(root: &ObjectDescription) -> impl Iterator<Item = &ObjectDescription> {
    let kinds = [PluginKind::Shape, PluginKind::Sensor, PluginKind::Emitter];
    let children = root.children.iter().map(|c| &*c.object);
    children.filter(move |o| kinds.contains(&o.kind))
}

/// Wavelength in nm that replaces missing or invalid wavelengths.
const GREEN: f64 = 550.0;
/// Maximum number of wavelengths; more are considered a mistake.
const MAX_WAVELENGTHS: usize = 4096;

/// Parses a list of wavelengths in nm; `None` if it is empty, too long or has values that are not
/// positive.
fn wavelengths(list: &str) -> Option<Vec<f64>> {
    let numbers = list.split([',', ' ']).filter(|word| !word.is_empty());
    let numbers: Option<Vec<f64>> = numbers.map(|word| word.parse().ok()).collect();
    let numbers = numbers.filter(|n| !n.is_empty() && n.len() <= MAX_WAVELENGTHS)?;
    let valid = numbers.iter().all(|nm| nm.is_finite() && *nm > 0.0);
    valid.then_some(numbers)
}
