//! Extinction along one arc (docs/theory.md#free-flight).

use super::{Medium, MediumLabel};
use crate::Spectrum;
use crate::phase::Sggx;
use crate::volume::{Section, VolumeTexture};
use eikonal::ray::{Arc, Profile};
use smallvec::{SmallVec, smallvec};

/// Largest turn of an arc, in radians, over one piece of the integral of the projected area of
/// flakes. Simpson's rule then errs by less than 1e-6 for flakes whose areas differ by a factor of
/// ten (`flakes_along_bent_arcs`).
const MAX_TURN: f64 = 0.05;

/// Attenuation of light by a medium along one arc, as a function of θ.
#[derive(Clone, Debug)]
pub enum Attenuation<'a> {
    /// No attenuation.
    None,
    /// Uniform extinction on any arc: depth is proportional to arc length.
    Uniform(Spectrum),
    /// Uniform extinction on a straight arc of this length: depth is proportional to θ.
    Even(Spectrum, f64),
    /// Extinction of one label on a straight arc of this length. The arc stays in the label as far
    /// as values are requested.
    Label(&'a MediumLabel, f64),
    /// Extinction of a grid along a straight arc, integrated on request.
    Sampled(Section<'a>),
    /// Extinction integrated along the parts of a bent arc that lie in the grid.
    Varying(SmallVec<[Profile<{ Spectrum::CHANNELS }>; 1]>),
}

impl<'a> Attenuation<'a> {
    /// Creates the attenuation of a straight arc that stays in its first label up to an optical
    /// depth in a channel. Values beyond this depth must not be requested. Returns `None` if the
    /// medium has no labels or the arc is not known to stay in the label.
    #[inline]
    pub fn in_label(medium: &'a Medium, arc: &Arc, channel: usize, depth: f64) -> Option<Self> {
        let (labels, length) = (medium.labels.as_ref()?, arc.arc_length(1.0));
        let direction = (arc.end() - arc.start()) / length;
        let label = labels.along(arc.start(), direction, channel, depth)?;
        Some(Attenuation::Label(label, length))
    }

    /// Creates the attenuation of the part θ ≤ `theta_end` of an arc.
    #[inline]
    pub fn new(medium: &'a Medium, arc: &Arc, theta_end: f64) -> Self {
        if medium.is_transparent() {
            return Attenuation::None;
        }
        if let Some(flakes) = medium.phase.flakes() {
            return Attenuation::of_flakes(medium, flakes, arc, theta_end);
        }
        match &medium.sigma_t {
            VolumeTexture::Uniform(sigma) if arc.is_straight() => {
                Attenuation::Even(*sigma * medium.scale, arc.arc_length(1.0))
            }
            VolumeTexture::Uniform(sigma) => Attenuation::Uniform(*sigma * medium.scale),
            VolumeTexture::Grid(grid) if arc.is_straight() => {
                Attenuation::Sampled(Section::new(grid, medium.scale, arc))
            }
            VolumeTexture::Grid(grid) => {
                let extinction = |x| (grid.at(x) * medium.scale).0;
                let parts = grid.bent_parts(arc, theta_end).into_iter();
                let profile = |part| Profile::new(arc, part, medium.spacing(), extinction);
                Attenuation::Varying(parts.map(profile).collect())
            }
        }
    }

    /// Creates the attenuation by flakes, which depends on the direction of the arc.
    fn of_flakes(medium: &'a Medium, flakes: &Sggx, arc: &Arc, theta_end: f64) -> Self {
        let length = arc.arc_length(1.0);
        if arc.is_straight() && flakes.is_uniform() {
            let direction = arc.velocity(0.0).normalize();
            let scale = medium.scale * flakes.projected_area(arc.start(), direction);
            return match &medium.sigma_t {
                VolumeTexture::Uniform(sigma) => Attenuation::Even(*sigma * scale, length),
                VolumeTexture::Grid(grid) => Attenuation::Sampled(Section::new(grid, scale, arc)),
            };
        }
        let parts = match &medium.sigma_t {
            VolumeTexture::Uniform(_) => smallvec![[0.0, theta_end]],
            VolumeTexture::Grid(grid) => grid.bent_parts(arc, theta_end),
        };
        let spacing = medium.spacing().min(flakes.spacing());
        let [start, middle, end] = [0.0, 0.5, 1.0].map(|part| arc.velocity(part * theta_end));
        let turn = start.angle_between(middle) + middle.angle_between(end);
        let spacing = spacing.min(length * (MAX_TURN / turn));
        let extinction = |x, direction| {
            let sigma = match &medium.sigma_t {
                VolumeTexture::Uniform(sigma) => *sigma,
                VolumeTexture::Grid(grid) => grid.at(x),
            };
            (sigma * (medium.scale * flakes.projected_area(x, direction))).0
        };
        let profile = |part| Profile::directed(arc, part, spacing, extinction);
        Attenuation::Varying(parts.into_iter().map(profile).collect())
    }

    /// Returns the label in which the arc lies, if it is known.
    #[inline]
    pub fn label(&self) -> Option<&'a MediumLabel> {
        match self {
            Attenuation::Label(label, _) => Some(label),
            _ => None,
        }
    }

    /// Prepares for many queries up to `theta_end`.
    pub fn tabulate(&mut self, theta_end: f64) {
        if let Attenuation::Sampled(section) = self {
            section.tabulate(theta_end);
        }
    }

    /// Returns the optical depth from the start of the arc to θ, given the arc length up to θ.
    #[inline]
    pub fn depth(&self, theta: f64, arc_length: f64) -> Spectrum {
        match self {
            Attenuation::None => Spectrum::ZERO,
            Attenuation::Uniform(sigma) => *sigma * arc_length,
            Attenuation::Even(sigma, length) => *sigma * (length * theta),
            Attenuation::Label(label, length) => label.extinction * (length * theta),
            Attenuation::Sampled(section) => section.integral(theta),
            Attenuation::Varying(profiles) => sum(profiles, |p| p.depth(theta)),
        }
    }

    /// Returns the extinction per unit length at θ, exactly the derivative of
    /// [`Attenuation::depth`].
    pub fn rate(&self, arc: &Arc, theta: f64) -> Spectrum {
        match self {
            Attenuation::None => Spectrum::ZERO,
            Attenuation::Uniform(sigma) | Attenuation::Even(sigma, _) => *sigma,
            Attenuation::Label(label, _) => label.extinction,
            Attenuation::Sampled(section) => section.value(arc.position(theta)),
            Attenuation::Varying(profiles) => {
                let speed = arc.velocity(theta).length() * arc.h();
                sum(profiles, |p| p.density(theta)) / speed
            }
        }
    }

    /// Finds where the depth of a channel reaches `target` on the part up to `theta_end`, of the
    /// given arc length, if anywhere. Also returns the depth up to this place, or up to the end.
    #[inline]
    pub fn reach(
        &self,
        arc: &Arc,
        (theta_end, arc_length): (f64, f64),
        channel: usize,
        target: f64,
    ) -> (Option<f64>, Spectrum) {
        let theta = match self {
            Attenuation::None => None,
            Attenuation::Uniform(sigma) => {
                let length = target / sigma[channel];
                let within = length < arc_length;
                let theta = within.then(|| arc.theta_at_length(length));
                return (theta, *sigma * if within { length } else { arc_length });
            }
            Attenuation::Even(sigma, length) => even(sigma[channel] * length, target, theta_end),
            Attenuation::Label(label, length) => {
                even(label.extinction[channel] * length, target, theta_end)
            }
            Attenuation::Sampled(section) => return section.reach(theta_end, channel, target),
            Attenuation::Varying(profiles) => {
                let mut left = target;
                let theta = profiles.iter().find_map(|profile| {
                    let theta = profile.invert(channel, left);
                    left -= profile.total()[channel];
                    theta
                });
                // Profiles of straight arcs may extend beyond `theta_end`.
                theta.filter(|theta| *theta <= theta_end)
            }
        };
        (theta, self.depth(theta.unwrap_or(theta_end), arc_length))
    }
}

/// Finds where a depth proportional to θ, with value `whole` at θ = 1, reaches a target before
/// `theta_end`.
fn even(whole: f64, target: f64, theta_end: f64) -> Option<f64> {
    let theta = target / whole;
    (theta < theta_end).then_some(theta)
}

/// Sums a quantity over the parts of an arc.
fn sum(
    profiles: &[Profile<{ Spectrum::CHANNELS }>],
    of: impl Fn(&Profile<{ Spectrum::CHANNELS }>) -> [f64; Spectrum::CHANNELS],
) -> Spectrum {
    let each = profiles.iter().map(|profile| Spectrum(of(profile)));
    each.fold(Spectrum::ZERO, |a, b| a + b)
}
