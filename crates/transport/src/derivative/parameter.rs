//! What light is differentiated by.

use super::DerivativeError;
use super::chart::{Chart, least};
use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::emitter::Class;
use crate::phase::Phase;
use crate::scene::{MediumId, Scene};
use crate::texture::Texture;
use std::sync::Arc;

/// What light is differentiated by. Coefficients are per unit length, the medium's `scale` included; they have one number where the
/// extinction of the medium (for the albedo, the albedo) is the same everywhere, one for each label, or one for each voxel, [z, y, x]. Reflectances have
/// one, or one for each pixel of an image, [y, x]. All have a value for each channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RadiometricParameter {
    /// Extinction σ_t of a medium, at the same albedo.
    Extinction(MediumId),
    /// Albedo of a medium, at the same extinction.
    Albedo(MediumId),
    /// Absorption coefficient μ_a of a medium, at the same scattering coefficient.
    Absorption(MediumId),
    /// Scattering coefficient μ_s of a medium, at the same absorption coefficient.
    Scattering(MediumId),
    /// Mean cosine g of a medium's Henyey–Greenstein phase function.
    MeanCosine(MediumId),
    /// Reflectance of the diffuse surface of an object, whose index is given: one colour, or an image.
    Reflectance(usize),
    /// A factor on all that an emitter emits, whose index is given; it is 1 in the scene.
    Emission(usize),
}

impl RadiometricParameter {
    /// Length along each axis, that of channels left out.
    pub fn shape(&self, scene: &Scene) -> Vec<usize> {
        match *self {
            RadiometricParameter::Extinction(id)
            | RadiometricParameter::Absorption(id)
            | RadiometricParameter::Scattering(id) => {
                Chart::of_extinction(scene.medium(id)).shape()
            }
            RadiometricParameter::Albedo(id) => Chart::of_albedo(scene.medium(id)).shape(),
            RadiometricParameter::Reflectance(object) => {
                match reflectance(&scene.objects()[object].bsdf) {
                    Some(Texture::Bitmap(bitmap)) => {
                        let [x, y] = bitmap.size();
                        vec![y, x]
                    }
                    _ => Vec::new(),
                }
            }
            RadiometricParameter::MeanCosine(_) | RadiometricParameter::Emission(_) => Vec::new(),
        }
    }

    /// Finds out whether a scene of so many channels has the derivative.
    fn check(&self, scene: &Scene, channels: usize) -> Result<(), DerivativeError> {
        let positive = |id: MediumId, what, quantity: Quantity, instead| {
            let medium = scene.medium(id);
            let least = match quantity {
                Quantity::Extinction => least(&medium.sigma_t, channels) * medium.scale,
                Quantity::Albedo => least(&medium.albedo, channels),
            };
            let name = medium.name.clone();
            let zero = DerivativeError::Zero {
                what,
                name,
                instead,
            };
            if least > 0.0 { Ok(()) } else { Err(zero) }
        };
        let absorption = ", or ask for sigma_a";
        match *self {
            RadiometricParameter::Absorption(_) | RadiometricParameter::Emission(_) => Ok(()),
            RadiometricParameter::Extinction(id) if scene.medium(id).albedo.is_zero() => Ok(()),
            RadiometricParameter::Extinction(id) => {
                positive(id, "sigma_t", Quantity::Extinction, absorption)
            }
            RadiometricParameter::Albedo(id) => positive(id, "the albedo", Quantity::Albedo, ""),
            RadiometricParameter::Scattering(id) => {
                positive(id, "sigma_t", Quantity::Extinction, absorption)?;
                positive(id, "sigma_s", Quantity::Albedo, absorption)
            }
            RadiometricParameter::MeanCosine(id) => match scene.medium(id).phase {
                Phase::HenyeyGreenstein(_) => Ok(()),
                _ => Err(DerivativeError::Phase(scene.medium(id).name.clone())),
            },
            RadiometricParameter::Reflectance(object) => {
                let of = &scene.objects()[object];
                let colour = reflectance(&of.bsdf);
                let colour = colour.ok_or_else(|| DerivativeError::Reflectance(of.name.clone()))?;
                let zero = DerivativeError::Zero {
                    what: "the reflectance",
                    name: of.name.clone(),
                    instead: "",
                };
                let is_positive = |value: Spectrum| value.0[..channels].iter().all(|c| *c > 0.0);
                let is_positive = colour.values().all(is_positive);
                if is_positive { Ok(()) } else { Err(zero) }
            }
        }
    }
}

/// What must not be zero.
enum Quantity {
    Extinction,
    Albedo,
}

/// The reflectance of a diffuse surface, if it is one colour or an image, the same on either side.
fn reflectance(bsdf: &Bsdf) -> Option<&Texture> {
    match bsdf {
        Bsdf::Diffuse(diffuse) => Some(diffuse.reflectance())
            .filter(|of| matches!(of, Texture::Uniform(_) | Texture::Bitmap(_))),
        Bsdf::TwoSided(both) => match both.sides().each_ref().map(reflectance) {
            [Some(front), Some(back)] if is_same(front, back) => Some(front),
            _ => None,
        },
        _ => None,
    }
}

fn is_same(a: &Texture, b: &Texture) -> bool {
    match (a, b) {
        (Texture::Uniform(a), Texture::Uniform(b)) => a == b,
        (Texture::Bitmap(a), Texture::Bitmap(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

/// Where the sums of parameters lie, and what each factor of a path adds to.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(super) media: Vec<MediumPlan>,
    /// For each object, where the sums of its reflectance begin, and that.
    pub(super) objects: Vec<Option<(usize, Texture)>>,
    /// For each emitter, where its sums begin.
    pub(super) emitters: Vec<Option<usize>>,
    /// Number of channels, whose sums are interleaved.
    pub(super) channels: usize,
    /// Where the sums of each parameter begin, and the number of all.
    pub(crate) starts: Vec<usize>,
}

/// What factors of a medium add to.
#[derive(Clone, Debug)]
pub(super) struct MediumPlan {
    /// How the extinction is made up.
    pub chart: Chart,
    /// How the albedo is.
    pub albedo_chart: Chart,
    /// Where sums begin, of what is asked for.
    pub extinction: Option<usize>,
    pub albedo: Option<usize>,
    pub absorption: Option<usize>,
    pub scattering: Option<usize>,
    pub mean_cosine: Option<usize>,
}

impl Plan {
    /// For parameters of a scene of so many channels.
    pub(crate) fn new(
        scene: &Scene,
        parameters: &[RadiometricParameter],
        channels: usize,
    ) -> Result<Self, DerivativeError> {
        if scene.emitters().iter().any(|e| e.class() == Class::Volume) {
            return Err(DerivativeError::Volumes);
        }
        let media = scene.media().iter().map(|medium| MediumPlan {
            chart: Chart::of_extinction(medium),
            albedo_chart: Chart::of_albedo(medium),
            extinction: None,
            albedo: None,
            absorption: None,
            scattering: None,
            mean_cosine: None,
        });
        let mut plan = Plan {
            media: media.collect(),
            objects: vec![None; scene.objects().len()],
            emitters: vec![None; scene.emitters().len()],
            channels,
            starts: vec![0],
        };
        let mut next = 0;
        for (i, parameter) in parameters.iter().enumerate() {
            if parameters[..i].contains(parameter) {
                return Err(DerivativeError::Twice);
            }
            parameter.check(scene, channels)?;
            let start = Some(next);
            match *parameter {
                RadiometricParameter::Extinction(id) => plan.media[id].extinction = start,
                RadiometricParameter::Albedo(id) => plan.media[id].albedo = start,
                RadiometricParameter::Absorption(id) => plan.media[id].absorption = start,
                RadiometricParameter::Scattering(id) => plan.media[id].scattering = start,
                RadiometricParameter::MeanCosine(id) => plan.media[id].mean_cosine = start,
                RadiometricParameter::Reflectance(object) => {
                    let colour = reflectance(&scene.objects()[object].bsdf);
                    plan.objects[object] = colour.map(|colour| (next, colour.clone()));
                }
                RadiometricParameter::Emission(emitter) => plan.emitters[emitter] = start,
            }
            next += channels * parameter.shape(scene).iter().product::<usize>();
            plan.starts.push(next);
        }
        Ok(plan)
    }

    /// Number of channels, whose sums are interleaved.
    pub(crate) fn channels(&self) -> usize {
        self.channels
    }

    /// Number of all sums.
    pub(crate) fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }
}
