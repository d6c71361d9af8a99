//! Principled bsdfs.

use super::super::side_request::Indices;
use super::super::surface_texture::Role;
use super::Maker;
use super::parameters::{Quantity, colour, number};
use crate::query::{Input, Query};
use transport::bsdf::{
    Bsdf, BsdfError, Principled, PrincipledParameters, PrincipledThin, PrincipledThinParameters,
};

/// Parameters that the solid and the thin bsdf share.
pub(super) struct Common<'a> {
    base_color: Quantity<'a>,
    luminance: Quantity<'a>,
    roughness: Quantity<'a>,
    anisotropic: Quantity<'a>,
    spec_trans: Quantity<'a>,
    spec_tint: Quantity<'a>,
    sheen: Quantity<'a>,
    sheen_tint: Quantity<'a>,
    flatness: Quantity<'a>,
}

/// Parameters of `principled`, for solids.
pub(super) struct Solid<'a> {
    common: Common<'a>,
    metallic: Quantity<'a>,
    clearcoat: Quantity<'a>,
    clearcoat_gloss: Quantity<'a>,
    eta: f64,
    transmits: bool,
}

/// Parameters of `principledthin`, for sheets.
pub(super) struct Thin<'a> {
    common: Common<'a>,
    diff_trans: Quantity<'a>,
    eta: f64,
}

/// Sampling rates of the lobes of `principled`. They are ignored, because they do not affect the
/// result.
const SOLID_RATES: [&str; 3] = [
    "main_specular_sampling_rate",
    "clearcoat_sampling_rate",
    "diffuse_reflectance_sampling_rate",
];
/// Sampling rates of the lobes of `principledthin`, which are ignored, too.
const THIN_RATES: [&str; 4] = [
    "diffuse_reflectance_sampling_rate",
    "specular_reflectance_sampling_rate",
    "specular_transmittance_sampling_rate",
    "diffuse_transmittance_sampling_rate",
];

/// Minimum index of surfaces that transmit light. It keeps the surface from vanishing.
const MIN_ETA: f64 = 1.001;
/// Minimum `specular` of surfaces that transmit light.
const MIN_SPECULAR: f64 = 1e-3;

fn common<'a>(q: &mut Query<'a, '_>) -> Common<'a> {
    let base_color = colour(q, "base_color");
    Common {
        luminance: Quantity("base_color", Role::Number, base_color.2.clone()),
        base_color,
        roughness: number(q, "roughness"),
        anisotropic: number(q, "anisotropic"),
        spec_trans: number(q, "spec_trans"),
        spec_tint: number(q, "spec_tint"),
        sheen: number(q, "sheen"),
        sheen_tint: number(q, "sheen_tint"),
        flatness: number(q, "flatness"),
    }
}

/// Marks sampling rates as used.
fn ignore(q: &mut Query, rates: &[&str]) {
    for rate in rates {
        q.float(rate);
    }
}

/// Returns true if an input is constant and zero in all channels.
fn is_zero(input: &Input) -> bool {
    matches!(input, Input::Spectrum(value) if {
        let values = value.values();
        !values.is_empty() && values.iter().all(|v| *v == 0.0)
    })
}

pub(super) fn solid<'a>(q: &mut Query<'a, '_>) -> Solid<'a> {
    ignore(q, &SOLID_RATES);
    let common = common(q);
    let transmits = !is_zero(&common.spec_trans.2);
    let eta = if q.has("eta") {
        if q.has("specular") {
            q.error("specular", "give 'eta' or 'specular', not both");
        }
        let eta = q.float("eta");
        if transmits && eta == 1.0 {
            MIN_ETA
        } else {
            eta
        }
    } else {
        let least = if transmits { MIN_SPECULAR } else { 0.0 };
        PrincipledParameters::eta_of(q.float("specular").max(least))
    };
    Solid {
        common,
        metallic: number(q, "metallic"),
        clearcoat: number(q, "clearcoat"),
        clearcoat_gloss: number(q, "clearcoat_gloss"),
        eta,
        transmits,
    }
}

pub(super) fn thin<'a>(q: &mut Query<'a, '_>) -> Thin<'a> {
    ignore(q, &THIN_RATES);
    Thin {
        common: common(q),
        diff_trans: number(q, "diff_trans"),
        eta: q.float("eta"),
    }
}

impl Solid<'_> {
    /// Returns the index inside that the surface requests, if it transmits light.
    pub(super) fn indices(&self, q: &Query) -> Option<Indices> {
        self.transmits.then(|| Indices {
            inner: Some(self.eta),
            outer: None,
            location: q.object().location.clone(),
        })
    }

    pub(super) fn make(self, maker: &mut Maker) -> Result<Bsdf, BsdfError> {
        let common = self.common;
        let parameters = PrincipledParameters {
            base_color: maker.texture(common.base_color),
            luminance: maker.texture(common.luminance),
            roughness: maker.texture(common.roughness),
            anisotropic: maker.texture(common.anisotropic),
            metallic: maker.texture(self.metallic),
            spec_trans: maker.texture(common.spec_trans),
            spec_tint: maker.texture(common.spec_tint),
            sheen: maker.texture(common.sheen),
            sheen_tint: maker.texture(common.sheen_tint),
            flatness: maker.texture(common.flatness),
            clearcoat: maker.texture(self.clearcoat),
            clearcoat_gloss: maker.texture(self.clearcoat_gloss),
            eta: self.eta,
        };
        Principled::new(parameters).map(|b| Bsdf::Principled(Box::new(b)))
    }
}

impl Thin<'_> {
    pub(super) fn make(self, maker: &mut Maker) -> Result<Bsdf, BsdfError> {
        let common = self.common;
        let parameters = PrincipledThinParameters {
            base_color: maker.texture(common.base_color),
            luminance: maker.texture(common.luminance),
            roughness: maker.texture(common.roughness),
            anisotropic: maker.texture(common.anisotropic),
            spec_trans: maker.texture(common.spec_trans),
            diff_trans: maker.texture(self.diff_trans),
            spec_tint: maker.texture(common.spec_tint),
            sheen: maker.texture(common.sheen),
            sheen_tint: maker.texture(common.sheen_tint),
            flatness: maker.texture(common.flatness),
            eta: self.eta,
        };
        PrincipledThin::new(parameters).map(|b| Bsdf::PrincipledThin(Box::new(b)))
    }
}
