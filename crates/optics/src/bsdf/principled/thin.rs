//! Principled sheet without thickness. Both sides are equal, and so are the indices around it.

use super::lobes::{Base, facets, is_untinted, schlick, schlick_weight, tint};
use super::{
    BsdfError, BsdfEvent, BsdfSample, Microfacets, Surface, check_eta, cosine_hemisphere_pdf,
    cosine_hemisphere_sample, factor, fresnel, reflect, share,
};
use crate::spectrum::Spectrum;
use crate::texture::Texture;
use glam::DVec3;

/// Parameters of a principled sheet; textures lie in [0, 1] unless stated otherwise.
#[derive(Clone, Debug)]
pub struct PrincipledThinParameters {
    /// Colour of the sheet.
    pub base_color: Texture,
    /// Luminance of `base_color`, by which tints are divided.
    pub luminance: Texture,
    /// Square root of the roughness of the facets.
    pub roughness: Texture,
    /// Anisotropy: excess of the roughness along ∂x/∂u over the roughness across it.
    pub anisotropic: Texture,
    /// Fraction of facets; the rest is diffuse.
    pub spec_trans: Texture,
    /// Twice the fraction of the diffuse light that is transmitted, in [0, 2].
    pub diff_trans: Texture,
    /// Fraction of the colour of the sheet in the reflections of facets.
    pub spec_tint: Texture,
    /// Sheen at grazing angles.
    pub sheen: Texture,
    /// Fraction of the colour of the sheet in the sheen.
    pub sheen_tint: Texture,
    /// Fraction of the diffuse reflection that approximates subsurface scattering.
    pub flatness: Texture,
    /// Index of the sheet, > 0.
    pub eta: f64,
}

/// Principled sheet. Facets reflect light, and also transmit it to the mirror image of the
/// reflected direction.
#[derive(Clone, Debug)]
pub struct PrincipledThin {
    parameters: PrincipledThinParameters,
}

/// Parameters at a point.
struct Local {
    base: Base,
    spec_trans: f64,
    diff_trans: f64,
    spec_tint: f64,
    tint: Spectrum,
    /// Facets for reflection, and facets for transmission.
    facets: [Microfacets; 2],
    eta: f64,
}

/// Pair of directions on the side of the viewer and their half vector. The second direction is
/// mirrored if light is transmitted.
struct Event {
    vectors: [DVec3; 3],
    transmitted: bool,
}

impl PrincipledThin {
    /// Creates the sheet.
    ///
    /// # Errors
    /// Fails if a texture has values outside its range, or if the index is not finite and > 0.
    pub fn new(parameters: PrincipledThinParameters) -> Result<Self, BsdfError> {
        let p = parameters;
        check_eta(p.eta)?;
        let outside = p.diff_trans.numbers().find(|v| !(0.0..=2.0).contains(v));
        if let Some(value) = outside {
            return Err(BsdfError::DiffuseTransmission { value });
        }
        let parameters = PrincipledThinParameters {
            base_color: factor("base_color", p.base_color)?,
            luminance: p.luminance,
            roughness: factor("roughness", p.roughness)?,
            anisotropic: factor("anisotropic", p.anisotropic)?,
            spec_trans: factor("spec_trans", p.spec_trans)?,
            diff_trans: p.diff_trans,
            spec_tint: factor("spec_tint", p.spec_tint)?,
            sheen: factor("sheen", p.sheen)?,
            sheen_tint: factor("sheen_tint", p.sheen_tint)?,
            flatness: factor("flatness", p.flatness)?,
            eta: p.eta,
        };
        Ok(PrincipledThin { parameters })
    }

    pub(in crate::bsdf) fn is_anisotropic(&self) -> bool {
        self.parameters.anisotropic.numbers().any(|v| v != 0.0)
    }

    fn local(&self, s: &Surface) -> Local {
        let p = &self.parameters;
        let number = |texture: &Texture| texture.number_at(&s.site);
        let colour = p.base_color.at(&s.site);
        let tint = tint(colour, number(&p.luminance));
        let sheen_tint = number(&p.sheen_tint);
        let sheen = (Spectrum::ONE * (1.0 - sheen_tint) + tint * sheen_tint) * number(&p.sheen);
        let roughness = number(&p.roughness);
        // Light is refracted twice in the sheet. A smaller index deflects it less (Burley 2015,
        // figure 15).
        let scaled = (0.65 * p.eta - 0.35) * roughness;
        let anisotropic = number(&p.anisotropic);
        Local {
            base: Base {
                colour,
                roughness,
                flatness: number(&p.flatness),
                sheen,
            },
            spec_trans: number(&p.spec_trans),
            diff_trans: 0.5 * number(&p.diff_trans),
            spec_tint: number(&p.spec_tint),
            tint,
            facets: [roughness, scaled].map(|r| facets(r, anisotropic)),
            eta: p.eta,
        }
    }

    pub(in crate::bsdf) fn sample(
        &self,
        s: &Surface,
        toward: DVec3,
        [u, v, w]: [f64; 3],
    ) -> Option<BsdfSample> {
        let (frame, local) = (s.facing(toward).frame(), self.local(s));
        let o = frame.to_local(toward);
        if o.z <= 0.0 {
            return None;
        }
        let (transmitted, i) = if u < local.spec_trans {
            let transmitted = u < 0.5 * local.spec_trans;
            let h = local.facets[usize::from(transmitted)].sample_visible(o, [v, w]);
            (transmitted, reflect(o, h, o.dot(h)).normalize())
        } else {
            let u = (u - local.spec_trans) / (1.0 - local.spec_trans);
            (u < local.diff_trans, cosine_hemisphere_sample([v, w]))
        };
        if i.z <= 0.0 {
            return None;
        }
        let i = if transmitted { mirrored(i) } else { i };
        let direction = frame.to_world(i).normalize();
        let pdf = self.pdf(s, toward, direction);
        let value = || self.eval(s, toward, direction);
        let sample = BsdfSample::reflected(direction, pdf, value)?;
        Some(BsdfSample {
            transmitted,
            ..sample
        })
    }

    pub(in crate::bsdf) fn albedo(&self, s: &Surface) -> Spectrum {
        self.parameters.base_color.at(&s.site)
    }

    /// Returns the colour of the sheet, unless other parameters depend on it by its luminance.
    pub(in crate::bsdf) fn tint(&self) -> Option<&Texture> {
        let p = &self.parameters;
        is_untinted([&p.spec_tint, &p.sheen, &p.sheen_tint]).then_some(&p.base_color)
    }

    /// Returns the derivative of the logarithm with respect to `base_color`, in which all light is
    /// linear.
    pub(in crate::bsdf) fn tint_derivative(&self, s: &Surface, by: &BsdfEvent) -> Spectrum {
        let Some(event) = event(s, by.toward, by.direction) else {
            return Spectrum::ZERO;
        };
        let mut local = self.local(s);
        let (whole, colour) = (local.scattered(&event), local.base.colour);
        local.base.colour = Spectrum::ZERO;
        share(whole - local.scattered(&event), whole * colour)
    }

    pub(in crate::bsdf) fn eval(&self, s: &Surface, toward: DVec3, direction: DVec3) -> Spectrum {
        event(s, toward, direction).map_or(Spectrum::ZERO, |event| self.local(s).scattered(&event))
    }

    pub(in crate::bsdf) fn pdf(&self, s: &Surface, toward: DVec3, direction: DVec3) -> f64 {
        let Some(event) = event(s, toward, direction) else {
            return 0.0;
        };
        let (local, [o, i, h]) = (self.local(s), event.vectors);
        let facets = local.facets[usize::from(event.transmitted)].pdf_reflected(o, h);
        let share = if event.transmitted {
            local.diff_trans
        } else {
            1.0 - local.diff_trans
        };
        0.5 * local.spec_trans * facets
            + (1.0 - local.spec_trans) * share * cosine_hemisphere_pdf(i)
    }
}

impl Local {
    /// Returns f̃ cosθᵢ.
    fn scattered(&self, event: &Event) -> Spectrum {
        let ([o, i, h], diffuse) = (event.vectors, 1.0 - self.spec_trans);
        let facets = &self.facets[usize::from(event.transmitted)];
        let facets = self.spec_trans * facets.g1(i) * facets.pdf_reflected(o, h);
        let cos = o.dot(h).clamp(0.0, 1.0);
        let f = fresnel::dielectric(cos, 1.0, self.eta).reflectance;
        if event.transmitted {
            let diffuse = diffuse * self.diff_trans * cosine_hemisphere_pdf(i);
            return self.base.colour * (facets * (1.0 - f) + diffuse);
        }
        let (weight, normal) = (
            schlick_weight(cos, self.eta),
            ((self.eta - 1.0) / (self.eta + 1.0)).powi(2),
        );
        let tinted = self.tint.map(|c| schlick(c * normal, weight));
        let reflectance = Spectrum::splat(f * (1.0 - self.spec_tint)) + tinted * self.spec_tint;
        let share = diffuse * (1.0 - self.diff_trans);
        reflectance * facets + self.base.value(&event.vectors, share, share)
    }
}

fn mirrored(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.y, -v.z)
}

fn event(s: &Surface, toward: DVec3, direction: DVec3) -> Option<Event> {
    let frame = s.facing(toward).frame();
    let (o, i) = (frame.to_local(toward), frame.to_local(direction));
    let transmitted = i.z < 0.0;
    let i = if transmitted { mirrored(i) } else { i };
    let half = (o + i).try_normalize()?;
    (o.z > 0.0 && i.z > 0.0).then_some(Event {
        vectors: [o, i, half],
        transmitted,
    })
}
