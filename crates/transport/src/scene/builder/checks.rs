//! Checks of the numbers from which a scene is built.

use super::error::{BuildError, BuildProblem};
use crate::Spectrum;
use crate::film::Filter;
use crate::medium::Medium;
use crate::scene::FilmSpec;
use crate::volume::VolumeTexture;
use eikonal::Shown;

/// Largest number of pixels along a side of a film.
const MAX_FILM_SIDE: usize = 1 << 16;

/// Problems found so far.
#[derive(Debug, Default)]
pub(super) struct Problems(Vec<BuildProblem>);

impl Problems {
    /// Adds a problem.
    pub(super) fn add(
        &mut self,
        subject: String,
        parameter: Option<&'static str>,
        message: String,
    ) {
        self.0.push(BuildProblem {
            subject,
            parameter,
            message,
        });
    }

    /// Returns the number of problems.
    pub(super) fn count(&self) -> usize {
        self.0.len()
    }

    /// Returns the value if there are no problems.
    pub(super) fn checked<T>(self, value: T) -> Result<T, BuildError> {
        if self.0.is_empty() {
            Ok(value)
        } else {
            Err(BuildError { problems: self.0 })
        }
    }

    pub(super) fn film(&mut self, film: &FilmSpec) {
        for (parameter, size) in [("width", film.width), ("height", film.height)] {
            if !(1..=MAX_FILM_SIDE).contains(&size) {
                let message = format!("must be 1 to {MAX_FILM_SIDE} pixels, but it is {size}");
                self.add("film".into(), Some(parameter), message);
            }
        }
        let (channels, most) = (film.channels, Spectrum::CHANNELS);
        if !(1..=most).contains(&channels) {
            let message = format!("must be 1 to {most}, but it is {channels}");
            self.add("film".into(), Some("channels"), message);
        }
        let [least, most] = Filter::RADII;
        let (parameter, width, deviations) = match film.filter {
            Filter::Tent { radius } => ("radius", radius, 1.0),
            Filter::Gaussian { stddev } => ("stddev", stddev, Filter::CUT),
            Filter::Box | Filter::Signed(_) => return,
        };
        let [least, most] = [least / deviations, most / deviations];
        if !(least..=most).contains(&width) {
            let message = format!(
                "must be {least} to {most} pixels, but it is {}",
                Shown(width)
            );
            self.add("filter".into(), Some(parameter), message);
        }
    }

    pub(super) fn media(&mut self, media: &[Medium]) {
        for (i, medium) in media.iter().enumerate() {
            let subject = || format!("medium {:?}", medium.name);
            if media[..i].iter().any(|other| other.name == medium.name) {
                let message = "another medium has the same name; give each its own";
                self.add(subject(), Some("name"), message.into());
            }
            if !(medium.scale >= 0.0 && medium.scale.is_finite()) {
                let message = format!(
                    "must be finite and not negative, but it is {}",
                    medium.scale
                );
                self.add(subject(), Some("scale"), message);
            }
            self.uniform(subject(), "sigma_t", &medium.sigma_t, f64::MAX);
            self.uniform(subject(), "albedo", &medium.albedo, 1.0);
            if medium.phase.flakes().is_some() && medium.labels.is_some() {
                let message = "must not be of flakes if the medium has labels";
                self.add(subject(), Some("phase"), message.into());
            }
            if let Some(emission) = &medium.emission {
                if medium.phase.flakes().is_some() {
                    let message = "must be absent if the phase function is of flakes";
                    self.add(subject(), Some("emission"), message.into());
                }
                self.uniform(subject(), "emission", emission, f64::MAX);
            }
        }
    }

    /// Checks that a uniform quantity lies in [0, `most`]. Values of grids were checked when the
    /// grids were made.
    fn uniform(
        &mut self,
        subject: String,
        parameter: &'static str,
        quantity: &VolumeTexture,
        most: f64,
    ) {
        let values = quantity.uniform().map_or([0.0; 4], |s| s.0);
        if let Some(value) = values.into_iter().find(|v| !(0.0..=most).contains(v)) {
            let range = if most == 1.0 {
                "in [0, 1]"
            } else {
                "finite and not negative"
            };
            self.add(
                subject,
                Some(parameter),
                format!("must be {range}, but it is {value}"),
            );
        }
    }

    pub(super) fn emission(&mut self, object: &str, radiance: Spectrum) {
        self.light(format!("object {object:?}"), "emission", radiance);
    }

    pub(super) fn light(&mut self, subject: String, parameter: &'static str, value: Spectrum) {
        let wrong = value.0.into_iter().find(|v| !(v.is_finite() && *v >= 0.0));
        if let Some(wrong) = wrong {
            let message = format!("must be finite and not negative, but it is {wrong}");
            self.add(subject, Some(parameter), message);
        }
    }

    pub(crate) fn unknown_medium(
        &mut self,
        object: &str,
        parameter: &'static str,
        name: &str,
        media: &[Medium],
    ) {
        let known: Vec<String> = media.iter().map(|m| format!("{:?}", m.name)).collect();
        let message = format!(
            "there is no medium {name:?}; there are {}",
            known.join(", ")
        );
        self.add(format!("object {object:?}"), Some(parameter), message);
    }
}
