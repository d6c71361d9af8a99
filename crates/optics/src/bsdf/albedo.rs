//! Colour of a surface, independent of the illumination.

use super::{Bsdf, Surface};
use crate::spectrum::Spectrum;
use glam::DVec3;
use std::f64::consts::PI;

impl Bsdf {
    /// Returns the diffuse reflectance where `toward` leads to the viewer, as in Mitsuba. For a
    /// diffuse base it is the colour of the base, whatever coats it. For other surfaces it is π
    /// times the value for light along the normal. It is zero for smooth mirrors and panes.
    pub fn albedo(&self, s: &Surface, toward: DVec3) -> Spectrum {
        match self {
            Bsdf::Diffuse(b) => b.albedo(s),
            Bsdf::RoughDiffuse(b) => b.albedo(s),
            Bsdf::GlossyDiffuse(b) => b.albedo(s),
            Bsdf::Plastic(b) => b.albedo(s),
            Bsdf::RoughPlastic(b) => b.albedo(s),
            Bsdf::Principled(b) => b.albedo(s),
            Bsdf::PrincipledThin(b) => b.albedo(s),
            Bsdf::Coating(b) => b.nested().albedo(s, toward),
            Bsdf::Mask(b) => b.nested().albedo(s, toward),
            Bsdf::NormalMap(b) => b.nested().albedo(s, toward),
            Bsdf::Blend(b) => b.albedo(s, toward),
            Bsdf::TwoSided(b) => b.albedo(s, toward),
            Bsdf::RoughDielectric(_) | Bsdf::RoughConductor(_) | Bsdf::PolarizedPlastic(_) => {
                self.eval(s, toward, s.shading_normal) * PI
            }
            Bsdf::Null | Bsdf::Dielectric(_) => Spectrum::ZERO,
            Bsdf::Conductor(_) | Bsdf::ThinDielectric(_) | Bsdf::Filter(_) => Spectrum::ZERO,
        }
    }
}
