//! Media that are tissues given by name (docs/scene/media.md#tissues).

use super::context::Context;
use crate::query::Query;
use crate::scene::{ObjectDescription, PluginKind};
use crate::tissue::{Content, MEAN_COSINE, Tissue};
use eikonal::Field;
use transport::Spectrum;
use transport::medium::Medium;
use transport::phase::Phase;
use transport::volume::VolumeTexture;

/// Tissue with its contents.
pub(super) struct Named {
    name: &'static str,
    tissue: Tissue,
    content: Content,
}

/// Reads the tissue that a medium names, if it names one.
pub(super) fn named(query: &mut Query) -> Option<Named> {
    let name = query.word("tissue");
    let tissue = Tissue::of(name)?;
    let others = ["sigma_t", "albedo", "sigma_s", "sigma_a", "material"];
    if let Some(other) = others.into_iter().find(|name| query.has(name)) {
        query.error(
            other,
            "give coefficients, a material or a tissue, not several",
        );
    }
    if query.child(PluginKind::Phase).is_some() {
        let message = format!(
            "tissues scatter by Henyey and Greenstein with g = {MEAN_COSINE}: leave the phase function out"
        );
        query.error("tissue", message);
    }
    if matches!(tissue, Tissue::Measured(_)) {
        let contents = ["blood", "saturation", "water", "fat", "melanin"];
        if let Some(name) = contents.into_iter().find(|name| query.has(name)) {
            let message = format!("the absorption of '{}' is measured: leave it out", name);
            query.error(name, message);
        }
    }
    let mut share = |name: &str| query.float(name);
    let content = Content {
        blood: share("blood"),
        saturation: share("saturation"),
        water: share("water"),
        fat: share("fat"),
        melanin: share("melanin"),
    };
    Some(Named {
        name,
        tissue,
        content,
    })
}

impl Named {
    /// Builds the medium of the tissue; transparent after an error.
    pub(super) fn medium(
        &self,
        object: &ObjectDescription,
        name: String,
        index: Field,
        scale: f64,
        context: &mut Context,
    ) -> Medium {
        let Some([scattered, absorbed]) = self.spectra(object, context) else {
            return Medium::transparent(name, index);
        };
        let total = scattered + absorbed;
        let phase = context.accept(&object.location, Phase::henyey_greenstein(MEAN_COSINE));
        Medium {
            name,
            index,
            sigma_t: VolumeTexture::Uniform(total),
            scale,
            albedo: VolumeTexture::Uniform(
                scattered.zip(total, |s, t| if t > 0.0 { s / t } else { 0.0 }),
            ),
            phase: phase.unwrap_or_else(Phase::isotropic),
            emission: None,
            velocity: None,
            fluorescence: None,
            labels: None,
        }
    }

    /// Returns σ_s and σ_a in the channels of the film; `None` after an error.
    fn spectra(&self, object: &ObjectDescription, context: &mut Context) -> Option<[Spectrum; 2]> {
        let Some(wavelengths) = context.wavelengths() else {
            let message = "tissues are known by wavelength: the film needs the pixel_format 'spectral', and 'wavelengths' in nm";
            context.error_at(&object.location, message);
            return None;
        };
        let [low, high] = self.tissue.range(self.content);
        if let Some(nm) = wavelengths.iter().find(|nm| !(low..=high).contains(*nm)) {
            let message = format!(
                "'{}'{} is known from {low} to {high} nm, not at {nm} nm",
                self.name,
                match self.tissue {
                    Tissue::Mean { .. } => " with this content",
                    Tissue::Measured(_) => "",
                }
            );
            context.error_at(&object.location, message);
            return None;
        }
        let at = |k: usize| {
            let value = |nm: &f64| self.tissue.coefficients(*nm, self.content)[k];
            Spectrum(std::array::from_fn(|c| {
                wavelengths.get(c).map_or(0.0, value)
            }))
        };
        Some([at(0), at(1)])
    }
}
