//! Colours of surfaces, and derivatives of the scattered light with respect to them.
//!
//! Theory: docs/theory.md#derivatives-of-light.

use super::{Bsdf, Surface};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Colour of a surface, named as in scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Tint {
    /// Reflectance of a surface with a single colour.
    Reflectance,
    /// Reflectance of a diffuse base or a diffuse part.
    DiffuseReflectance,
    /// Factor of the reflection by a smooth or rough surface, or reflectance of a glossy part.
    SpecularReflectance,
    /// Factor of the transmission by a smooth or rough interface, or by a pane.
    SpecularTransmittance,
    /// Transmittance of a filter.
    Transmittance,
    /// Colour of a principled surface.
    BaseColor,
}

/// Scattering event at a surface point.
#[derive(Clone, Copy, Debug)]
pub struct BsdfEvent {
    /// Unit vector towards the viewer.
    pub toward: DVec3,
    /// Unit vector towards the light.
    pub direction: DVec3,
    /// True for a delta event, or for light that passes undeflected.
    pub delta: bool,
}

impl Tint {
    /// All colours.
    pub const ALL: [Tint; 6] = [
        Tint::Reflectance,
        Tint::DiffuseReflectance,
        Tint::SpecularReflectance,
        Tint::SpecularTransmittance,
        Tint::Transmittance,
        Tint::BaseColor,
    ];

    /// Returns the name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Tint::Reflectance => "reflectance",
            Tint::DiffuseReflectance => "diffuse_reflectance",
            Tint::SpecularReflectance => "specular_reflectance",
            Tint::SpecularTransmittance => "specular_transmittance",
            Tint::Transmittance => "transmittance",
            Tint::BaseColor => "base_color",
        }
    }
}

impl BsdfEvent {
    /// Returns true if light crosses the surface.
    fn crosses(&self, s: &Surface) -> bool {
        s.normal.dot(self.toward) * s.normal.dot(self.direction) < 0.0
    }
}

impl Bsdf {
    /// Returns the colour `tint`. Returns `None` if the bsdf has no such colour, has several, or
    /// has no derivatives with respect to it.
    pub fn tint(&self, tint: Tint) -> Option<Texture> {
        match (self, tint) {
            (Bsdf::Diffuse(b), Tint::Reflectance) => Some(b.reflectance().clone()),
            (Bsdf::RoughDiffuse(b), Tint::Reflectance) => Some(b.reflectance().clone()),
            (Bsdf::Conductor(b), Tint::SpecularReflectance) => {
                Some(b.metal().specular_reflectance().clone())
            }
            (Bsdf::RoughConductor(b), Tint::SpecularReflectance) => {
                Some(b.metal().specular_reflectance().clone())
            }
            (Bsdf::Dielectric(b), _) => b.tint(tint).map(Texture::from),
            (Bsdf::RoughDielectric(b), _) => b.tint(tint).cloned(),
            (Bsdf::ThinDielectric(b), _) => b.tint(tint).cloned(),
            (Bsdf::Plastic(b), _) => b.tint(tint).cloned(),
            (Bsdf::RoughPlastic(b), _) => b.tint(tint).cloned(),
            (Bsdf::PolarizedPlastic(b), _) => b.tint(tint).cloned(),
            (Bsdf::GlossyDiffuse(b), _) => b.tint(tint).cloned(),
            (Bsdf::Filter(b), Tint::Transmittance) => Some(b.transmittance().clone()),
            (Bsdf::Principled(b), Tint::BaseColor) => b.tint().cloned(),
            (Bsdf::PrincipledThin(b), Tint::BaseColor) => b.tint().cloned(),
            (Bsdf::Mask(b), _) => b.nested().tint(tint),
            (Bsdf::NormalMap(b), _) => b.nested().tint(tint),
            (Bsdf::Coating(b), _) => b.tint(tint),
            (Bsdf::TwoSided(b), _) => common(b.sides(), tint),
            // If both parts are mirrors, the direction does not reveal which of them reflected the
            // light.
            (Bsdf::Blend(b), _) if !b.pair().iter().all(Bsdf::is_mirror) => common(b.pair(), tint),
            _ => None,
        }
    }

    /// Returns the derivative of the logarithm of the scattered light with respect to a
    /// [colour](Bsdf::tint), in each channel. Returns zero if there is no such colour, or where
    /// nothing is scattered.
    pub fn tint_derivative(&self, tint: Tint, s: &Surface, event: &BsdfEvent) -> Spectrum {
        let Some(colour) = self.tint(tint) else {
            return Spectrum::ZERO;
        };
        if self.is_shaded(s) && !event.delta {
            return self.tint_derivative_by_normal(tint, &colour, &s.shaded(), event);
        }
        self.tint_derivative_by_normal(tint, &colour, s, event)
    }

    fn tint_derivative_by_normal(
        &self,
        tint: Tint,
        colour: &Texture,
        s: &Surface,
        event: &BsdfEvent,
    ) -> Spectrum {
        let in_proportion = || reciprocal(colour.at(&s.site));
        match self {
            Bsdf::Diffuse(_) | Bsdf::Conductor(_) | Bsdf::RoughConductor(_) | Bsdf::Filter(_) => {
                in_proportion()
            }
            Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_) | Bsdf::ThinDielectric(_) => {
                let other = if event.crosses(s) {
                    Tint::SpecularReflectance
                } else {
                    Tint::SpecularTransmittance
                };
                if tint == other {
                    Spectrum::ZERO
                } else {
                    in_proportion()
                }
            }
            Bsdf::Plastic(b) => b.tint_derivative(tint, s, event),
            Bsdf::RoughPlastic(b) => b.tint_derivative(tint, s, event),
            Bsdf::PolarizedPlastic(b) => b.tint_derivative(tint, s, event),
            Bsdf::RoughDiffuse(b) => b.tint_derivative(s, event),
            Bsdf::GlossyDiffuse(b) => b.tint_derivative(tint, s, event),
            Bsdf::Coating(b) => b.tint_derivative(tint, s, event),
            Bsdf::TwoSided(b) => b.tint_derivative(tint, s, event),
            Bsdf::Blend(b) => b.tint_derivative(tint, s, event),
            // Light that passes the holes is unchanged.
            Bsdf::Mask(_) if event.delta && event.crosses(s) => Spectrum::ZERO,
            Bsdf::Mask(b) => b.nested().tint_derivative(tint, s, event),
            Bsdf::NormalMap(b) => b.tint_derivative(tint, s, event),
            Bsdf::Principled(b) => b.tint_derivative(s, event),
            Bsdf::PrincipledThin(b) => b.tint_derivative(s, event),
            Bsdf::Null => Spectrum::ZERO,
        }
    }
}

/// Returns the colour of a pair of surfaces, if only one of them has it or both share it. Black
/// beside another colour does not count, because nothing has derivatives with respect to it.
fn common(pair: &[Bsdf; 2], tint: Tint) -> Option<Texture> {
    let is_black = |colour: &Texture| matches!(colour, Texture::Uniform(c) if c.is_zero());
    match pair.each_ref().map(|bsdf| bsdf.tint(tint)) {
        [Some(one), None] | [None, Some(one)] => Some(one),
        [Some(one), Some(black)] | [Some(black), Some(one)] if is_black(&black) => Some(one),
        [Some(one), Some(other)] => one.is_same(&other).then_some(one),
        [None, None] => None,
    }
}

/// Returns 1/ρ, and zero where ρ is zero.
pub(super) fn reciprocal(colour: Spectrum) -> Spectrum {
    share(Spectrum::ONE, colour)
}

/// Returns the part over the whole, and zero where the whole is zero.
pub(super) fn share(part: Spectrum, whole: Spectrum) -> Spectrum {
    part.zip(
        whole,
        |part, whole| if whole > 0.0 { part / whole } else { 0.0 },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::*;

    const COLOURS: [f64; 2] = [0.35, 0.45];

    fn facets() -> Roughness {
        Roughness::new(Distribution::Beckmann, 0.4).unwrap()
    }

    fn diffuse(colour: f64) -> Bsdf {
        Bsdf::Diffuse(Diffuse::new(colour).unwrap())
    }

    fn rough_plastic([a, b]: [f64; 2], nonlinear: bool) -> Bsdf {
        let plastic = RoughPlastic::new(facets(), !nonlinear, 1.7, a, b, nonlinear);
        Bsdf::RoughPlastic(plastic.unwrap())
    }

    fn coated(roughness: Option<Roughness>, nested: Bsdf, specular_reflectance: f64) -> Bsdf {
        let parameters = CoatingParameters {
            eta: 1.6,
            sigma_a: 0.3.into(),
            thickness: 0.5,
            specular_reflectance: specular_reflectance.into(),
            roughness,
        };
        Bsdf::Coating(Box::new(Coating::new(parameters, nested).unwrap()))
    }

    fn principled(base_color: f64, spec_trans: f64) -> Principled {
        Principled::new(PrincipledParameters {
            base_color: base_color.into(),
            roughness: 0.6.into(),
            metallic: 0.3.into(),
            spec_trans: spec_trans.into(),
            sheen: 0.5.into(),
            clearcoat: 0.7.into(),
            ..PrincipledParameters::default()
        })
        .unwrap()
    }

    fn sheet(base_color: f64) -> PrincipledThin {
        let zero = || Texture::from(0.0);
        PrincipledThin::new(PrincipledThinParameters {
            base_color: base_color.into(),
            luminance: base_color.into(),
            roughness: 0.6.into(),
            anisotropic: zero(),
            spec_trans: 0.4.into(),
            diff_trans: 0.8.into(),
            spec_tint: zero(),
            sheen: 0.5.into(),
            sheen_tint: zero(),
            flatness: zero(),
            eta: 1.5,
        })
        .unwrap()
    }

    /// Constructor of a surface from two colours, and the names of these colours.
    type Case = (fn([f64; 2]) -> Bsdf, [Tint; 2]);

    const BOTH: [Tint; 2] = [Tint::DiffuseReflectance, Tint::SpecularReflectance];

    fn cases() -> Vec<Case> {
        let one = Tint::Reflectance;
        let interface = [Tint::SpecularReflectance, Tint::SpecularTransmittance];
        vec![
            (|[a, _]| diffuse(a), [one; 2]),
            (
                |[a, _]| Bsdf::RoughDiffuse(RoughDiffuse::new(a, 0.7, false).unwrap()),
                [one; 2],
            ),
            (
                |[a, b]| Bsdf::RoughDielectric(RoughDielectric::new(facets(), a, b).unwrap()),
                interface,
            ),
            (
                |[a, b]| Bsdf::Plastic(Plastic::new(1.7, a, b, true).unwrap()),
                [Tint::DiffuseReflectance; 2],
            ),
            (
                |[a, b]| Bsdf::Plastic(Plastic::new(1.7, a, b, false).unwrap()),
                [Tint::DiffuseReflectance; 2],
            ),
            (
                |[a, _]| Bsdf::Principled(Box::new(principled(a, 0.0))),
                [Tint::BaseColor; 2],
            ),
            (
                |[a, _]| Bsdf::Principled(Box::new(principled(a, 0.6))),
                [Tint::BaseColor; 2],
            ),
            (
                |[a, _]| Bsdf::PrincipledThin(Box::new(sheet(a))),
                [Tint::BaseColor; 2],
            ),
            (|colours| rough_plastic(colours, true), BOTH),
            (|colours| rough_plastic(colours, false), BOTH),
            (
                |[a, b]| {
                    let plastic = PolarizedPlastic::new(facets(), 1.7, a, b);
                    Bsdf::PolarizedPlastic(plastic.unwrap())
                },
                BOTH,
            ),
            (
                |[a, b]| {
                    let lobe = GlossyLobe::Phong(5.0.into());
                    Bsdf::GlossyDiffuse(Box::new(GlossyDiffuse::new(lobe, a, b).unwrap()))
                },
                BOTH,
            ),
            (
                |[a, b]| {
                    let lobe = GlossyLobe::Ward(facets());
                    Bsdf::GlossyDiffuse(Box::new(GlossyDiffuse::new(lobe, a, b).unwrap()))
                },
                BOTH,
            ),
            // The perturbed normal depends on the viewer.
            (
                |colours| {
                    let normal = Texture::Uniform(Spectrum([0.9, 0.3, 0.6, 0.0]));
                    let source = NormalSource::Normals(normal);
                    let map = NormalMap::new(source, true, true, rough_plastic(colours, true));
                    Bsdf::NormalMap(Box::new(map.unwrap()))
                },
                BOTH,
            ),
            (
                |[a, b]| {
                    let blend = BlendBsdf::new(0.3, diffuse(a), rough_plastic([0.2, b], true));
                    Bsdf::Blend(blend.unwrap())
                },
                [one, Tint::SpecularReflectance],
            ),
            // Mix with a black surface.
            (
                |[a, _]| Bsdf::Blend(BlendBsdf::new(0.3, diffuse(a), diffuse(0.0)).unwrap()),
                [one; 2],
            ),
            (
                |[a, b]| coated(Some(facets()), diffuse(a), b),
                [one, Tint::SpecularReflectance],
            ),
            (|[a, _]| coated(None, diffuse(a), 0.9), [one; 2]),
            (
                |[a, b]| {
                    let two = TwoSided::new(diffuse(a), rough_plastic([0.2, b], true));
                    Bsdf::Mask(Mask::new(0.4, Bsdf::TwoSided(two.unwrap())).unwrap())
                },
                [one, Tint::SpecularReflectance],
            ),
        ]
    }

    fn directions() -> impl Iterator<Item = [DVec3; 2]> {
        let at = |i: u32, s: f64| {
            let z = 1.0 - 2.0 * (s * (f64::from(i) + 0.5)).fract();
            let (sin, turn) = ((1.0 - z * z).sqrt(), 2.4 * f64::from(i) * (1.0 + s));
            DVec3::new(sin * turn.cos(), sin * turn.sin(), z)
        };
        (0..400).map(move |i| [at(i, 0.618_034), at(i, 0.754_878)])
    }

    /// Compares derivatives with differences for both directions of light, by the geometric normal
    /// and by another normal.
    #[test]
    fn derivatives_are_those_of_what_is_scattered() {
        let (h, leaning) = (1e-5, DVec3::new(0.3, 0.1, 0.95).normalize());
        for (k, (made, tints)) in cases().into_iter().enumerate() {
            for (i, tint) in tints.into_iter().enumerate() {
                let bsdf = made(COLOURS);
                assert!(bsdf.tint(tint).is_some(), "{k} {tint:?}");
                let [down, up] = [-h, h].map(|h| {
                    let mut colours = COLOURS;
                    colours[if tints[0] == tints[1] { 0 } else { i }] += h;
                    made(colours)
                });
                let mut seen = 0;
                for shading_normal in [DVec3::Z, leaning] {
                    let plain = Surface::plain(DVec3::Z, 1.0, 1.5);
                    let tangents = [DVec3::X, DVec3::Y];
                    let s = Surface {
                        shading_normal,
                        tangents,
                        ..plain
                    };
                    for [toward, direction] in directions() {
                        let [a, b] = [&down, &up].map(|bsdf| bsdf.eval(&s, toward, direction)[0]);
                        if a + b < 1e-9 {
                            continue;
                        }
                        let event = BsdfEvent {
                            toward,
                            direction,
                            delta: false,
                        };
                        let found = bsdf.tint_derivative(tint, &s, &event)[0];
                        let exact = (b.ln() - a.ln()) / (2.0 * h);
                        assert!(
                            (found - exact).abs() < 1e-6 * (1.0 + exact.abs()),
                            "{k} {tint:?}: {found} {exact}"
                        );
                        seen += u32::from(exact != 0.0);
                    }
                }
                assert!(seen > 20, "{k} {tint:?}: {seen}");
            }
        }
    }

    /// Tests that two different colours of one name are refused, as are the colours of two mirrors.
    #[test]
    fn colours_of_several_surfaces_are_told_apart_or_refused() {
        let two = |a, b| Bsdf::TwoSided(TwoSided::new(diffuse(a), diffuse(b)).unwrap());
        assert!(two(0.5, 0.5).tint(Tint::Reflectance).is_some());
        assert!(two(0.5, 0.4).tint(Tint::Reflectance).is_none());
        for pair in [two(0.5, 0.0), two(0.0, 0.5)] {
            let seen = pair.tint(Tint::Reflectance).unwrap();
            assert!(seen.values().eq([Spectrum::splat(0.5)]));
        }
        let metal = || {
            let metal = Conductor::new(Spectrum::splat(0.5), Spectrum::splat(2.0), 0.8);
            Bsdf::Conductor(metal.unwrap())
        };
        let blend = |a, b| Bsdf::Blend(BlendBsdf::new(0.5, a, b).unwrap());
        let tint = Tint::SpecularReflectance;
        assert!(blend(metal(), diffuse(0.5)).tint(tint).is_some());
        assert!(blend(metal(), metal()).tint(tint).is_none());
        let phong = |a: f64, b: f64| {
            let lobe = GlossyLobe::Phong(5.0.into());
            Bsdf::GlossyDiffuse(Box::new(GlossyDiffuse::new(lobe, a, b).unwrap()))
        };
        assert!(phong(0.5, 0.5).tint(tint).is_some());
        assert!(phong(0.5, 0.6).tint(tint).is_none());
        let tinted = Principled::new(PrincipledParameters {
            spec_tint: 0.1.into(),
            ..PrincipledParameters::default()
        });
        assert!(tinted.unwrap().tint().is_none());
    }
}
