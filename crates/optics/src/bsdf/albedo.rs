//! The colour of a surface, whatever light falls on it.

use super::{Bsdf, Surface};
use crate::spectrum::Spectrum;
use glam::DVec3;
use std::f64::consts::PI;

impl Bsdf {
    /// The diffuse reflectance where `toward` leads to the viewer, as in Mitsuba: the colour of a diffuse base whatever coats it, and
    /// of other surfaces π times the value for light along the normal. Zero of smooth mirrors and panes.
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
