//! Spotlight.

use super::EmitterValues;
use super::table::sampling_table;
use crate::sampling::sphere::{uniform_cone_inverse, uniform_cone_sample};
use crate::sampling::{DistributionError, Frame, Grid2};
use crate::shape::{Site, Uv};
use crate::texture::Texture;
use crate::{Orientation, Spectrum};
use eikonal::Shown;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// Reason why a spot cannot project a texture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpotTextureError {
    /// A value is negative or not finite.
    #[error("a value of the texture is {}; light must be finite and not negative", Shown(*value))]
    Value {
        /// The value.
        value: f64,
    },
    /// The cone is too wide: no plane perpendicular to the axis shows all of it.
    #[error("a spot that throws a texture needs a cutoff_angle below 90 degrees")]
    Wide,
    /// The texture cannot be sampled.
    #[error(transparent)]
    Distribution(#[from] DistributionError),
}

/// Number of points along each side of the unit square for summing the power of a textured spot.
const POWER_POINTS: usize = 1024;

/// Point source with full intensity inside a cone. The intensity falls linearly with the angle to
/// zero at a wider cone. The spot may project a texture (as Mitsuba's `spot`).
#[derive(Clone, Debug)]
pub struct Spot {
    position: DVec3,
    axis: DVec3,
    intensity: Spectrum,
    cutoff: f64,
    beam_width: f64,
    thrown: Option<Arc<Thrown>>,
}

/// Texture that a spot projects.
#[derive(Clone, Debug)]
struct Thrown {
    /// Orientation with local +z along the axis; u runs along local +x, v along +y.
    orientation: Orientation,
    texture: Texture,
    /// Density over the two numbers that give a direction of the cone.
    table: Grid2,
    /// Total power.
    power: Spectrum,
}

impl Spot {
    /// Creates a spot. `axis` is the direction of the cone, not zero, and `intensity` is the
    /// intensity inside `beam_width`. Angles are half angles in radians, with 0 ≤ `beam_width` ≤
    /// `cutoff`, 0 < `cutoff` ≤ π.
    pub fn new(
        position: DVec3,
        axis: DVec3,
        intensity: Spectrum,
        cutoff: f64,
        beam_width: f64,
    ) -> Self {
        Spot {
            position,
            axis: axis.normalize(),
            intensity,
            cutoff,
            beam_width,
            thrown: None,
        }
    }

    /// Returns the spot displaced by `shift`.
    pub fn moved(&self, shift: DVec3) -> Self {
        Spot {
            position: self.position + shift,
            ..self.clone()
        }
    }

    /// Returns the spot with its axis along local +z and its intensity multiplied by a texture. For
    /// the local direction (x, y, z), the texture coordinates are ½ + ½ (x, y)/(z tan `cutoff`).
    /// The texture must depend on texture coordinates only, and the cutoff must be less than π/2.
    ///
    /// # Errors
    /// Fails if the cutoff is π/2 or more, or if values of the texture are negative, not finite, or
    /// zero all over the spot.
    pub fn with_texture(
        self,
        orientation: Orientation,
        texture: Texture,
    ) -> Result<Self, SpotTextureError> {
        if self.cutoff >= FRAC_PI_2 {
            return Err(SpotTextureError::Wide);
        }
        let bad = |v: &f64| !(v.is_finite() && *v >= 0.0);
        if let Some(value) = texture.numbers().find(bad) {
            return Err(SpotTextureError::Value { value });
        }
        let local = |u| uniform_cone_sample(self.cap(), u);
        let light = |u| {
            let direction = local(u);
            self.tint(&texture, direction) * self.falloff(polar_angle(direction))
        };
        let table = sampling_table(|u| (self.intensity * light(u)).sum())?;
        let at = |k: usize| (k as f64 + 0.5) / POWER_POINTS as f64;
        let points = (0..POWER_POINTS).flat_map(|y| (0..POWER_POINTS).map(move |x| [at(x), at(y)]));
        let sum = points.fold(Spectrum::ZERO, |sum, u| sum + light(u));
        let mean = sum / (POWER_POINTS * POWER_POINTS) as f64;
        let thrown = Thrown {
            power: self.intensity * mean * (TAU * self.cap()),
            orientation,
            texture,
            table,
        };
        Ok(Spot {
            axis: orientation.to_world(DVec3::Z),
            thrown: Some(Arc::new(thrown)),
            ..self
        })
    }

    /// Returns the projected texture, or the intensity at the centre of the cone without one.
    pub(super) fn values(&self) -> EmitterValues<'_> {
        match &self.thrown {
            Some(thrown) => EmitterValues::Texture(&thrown.texture),
            None => EmitterValues::One(self.intensity),
        }
    }

    /// Returns the surface point that selects the texture value of a unit direction within the
    /// cone.
    pub(super) fn site(&self, direction: DVec3) -> Option<Site> {
        let thrown = self.thrown.as_ref()?;
        Some(self.site_in(thrown.orientation.to_local(direction)))
    }

    /// Returns the position.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Returns the unit direction of the cone.
    pub fn axis(&self) -> DVec3 {
        self.axis
    }

    /// Returns the half angle of the cone in radians.
    pub fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// Returns the half angle of full intensity in radians.
    pub fn beam_width(&self) -> f64 {
        self.beam_width
    }

    /// Returns the radiant intensity in a unit direction.
    pub fn intensity(&self, direction: DVec3) -> Spectrum {
        let falloff = self.falloff(self.angle(direction));
        match &self.thrown {
            Some(thrown) if falloff > 0.0 => {
                let local = thrown.orientation.to_local(direction);
                self.intensity * self.tint(&thrown.texture, local) * falloff
            }
            _ => self.intensity * falloff,
        }
    }

    /// Returns the fraction of the full intensity at an angle from the axis, without the texture.
    fn falloff(&self, angle: f64) -> f64 {
        if angle <= self.beam_width {
            1.0
        } else if angle >= self.cutoff {
            0.0
        } else {
            (self.cutoff - angle) / (self.cutoff - self.beam_width)
        }
    }

    /// Returns the value of a texture in a local direction within the cone.
    fn tint(&self, texture: &Texture, local: DVec3) -> Spectrum {
        texture.at(&self.site_in(local))
    }

    /// Returns the surface point that selects the texture value of a local direction within the
    /// cone.
    fn site_in(&self, local: DVec3) -> Site {
        let width = local.z * self.cutoff.tan();
        let uv = [local.x, local.y].map(|c| 0.5 + 0.5 * c / width);
        Site {
            uv: Uv::Plain(uv),
            ..Site::default()
        }
    }

    /// Returns the total power 2π ∫ I sin θ dθ: I is constant up to the beam width, then falls
    /// linearly to the cutoff. With a texture, the power is a sum over directions, usually within
    /// 1e-4.
    pub fn power(&self) -> Spectrum {
        if let Some(thrown) = &self.thrown {
            return thrown.power;
        }
        let (inner, outer) = (self.beam_width, self.cutoff);
        let ramp = match outer - inner {
            // Use the limit of a narrow ramp to avoid cancellation.
            width if width < 1e-6 => (0.5 * (inner + outer)).cos(),
            width => (outer.sin() - inner.sin()) / width,
        };
        self.intensity * (TAU * (1.0 - ramp))
    }

    /// Samples a direction of the cone: uniform, or with density roughly proportional to the
    /// intensity if there is a texture.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        match &self.thrown {
            Some(thrown) => {
                let local = uniform_cone_sample(self.cap(), thrown.table.sample(u).0);
                thrown.orientation.to_world(local)
            }
            None => {
                let local = uniform_cone_sample(self.cap(), u);
                Frame::from_normal(self.axis).to_world(local).normalize()
            }
        }
    }

    /// Returns the density of [`Spot::sample`] per steradian.
    pub(super) fn pdf(&self, direction: DVec3) -> f64 {
        if self.angle(direction) > self.cutoff {
            return 0.0;
        }
        let uniform = 1.0 / (TAU * self.cap());
        match &self.thrown {
            Some(thrown) => {
                let local = thrown.orientation.to_local(direction);
                let u = uniform_cone_inverse(self.cap(), local);
                uniform * thrown.table.pdf(u.map(|c| c.clamp(0.0, 1.0)))
            }
            None => uniform,
        }
    }

    /// Returns the angle from the axis. Unlike the arc cosine, this form keeps its digits in a
    /// narrow cone.
    fn angle(&self, direction: DVec3) -> f64 {
        let sin = self.axis.cross(direction).length();
        sin.atan2(self.axis.dot(direction))
    }

    /// Returns the height 1 − cos of the cap that the cone cuts out of the unit sphere.
    fn cap(&self) -> f64 {
        2.0 * (0.5 * self.cutoff).sin().powi(2)
    }
}

/// Returns the angle of a unit vector from +z.
fn polar_angle(local: DVec3) -> f64 {
    local.x.hypot(local.y).atan2(local.z)
}
