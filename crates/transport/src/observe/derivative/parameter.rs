//! What light is differentiated by.

use super::DerivativeError;
use super::chart::{Chart, largest, least};
use crate::Spectrum;
use crate::bsdf::Tint;
use crate::emitter::{Emitter, EmitterValues};
use crate::medium::Medium;
use crate::scene::{MediumId, Object, Scene};
use crate::texture::Texture;
use std::ops::Range;

/// What light is differentiated by. Coefficients are per unit length, the medium's `scale` included; they have one number where the
/// extinction of the medium (for the albedo, the albedo) is the same everywhere, one for each label, or one for each voxel, [z, y, x]. Colours have
/// one, or one for each pixel of an image, [y, x], each vertex or triangle of a mesh that is coloured, or each of the two colours of a checkerboard; so have
/// emitters that throw a texture. All have a value for each channel.
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
    /// Mean cosine g of a medium's Henyey–Greenstein phase function: one, one for each label, or one for each voxel.
    MeanCosine(MediumId),
    /// A [colour](crate::bsdf::Bsdf::tint) of an object's surface, whose index is given: one, or those of a texture.
    Colour(usize, Tint),
    /// A factor on all that an emitter emits, whose index is given; it is 1 in the scene.
    Emission(usize),
    /// What an emitter's light is made up of, given its index: its radiance, intensity or irradiance, or the power of a beam or fibre; the pixels of an image; the
    /// voxels of a volume, or, as the coefficients of a medium, what that emits.
    Radiance(usize),
    /// A factor on all light that is measured; it is 1 in the scene.
    Exposure,
}

impl RadiometricParameter {
    /// Length along each axis, that of channels left out; none of what the scene does not have.
    pub fn shape(&self, scene: &Scene) -> Vec<usize> {
        if self.exists(scene).is_err() {
            return Vec::new();
        }
        match *self {
            RadiometricParameter::Extinction(id)
            | RadiometricParameter::Absorption(id)
            | RadiometricParameter::Scattering(id) => {
                Chart::of_extinction(scene.medium(id)).shape()
            }
            RadiometricParameter::Albedo(id) => Chart::of_albedo(scene.medium(id)).shape(),
            RadiometricParameter::Colour(object, tint) => {
                let colours = scene.objects()[object].bsdf.tint(tint);
                colours.and_then(|c| c.shape()).unwrap_or_default()
            }
            RadiometricParameter::Radiance(emitter) => {
                let emitter = &scene.emitters()[emitter];
                match emitting_medium(emitter) {
                    Some(id) => Chart::of_emission(scene.medium(id)).shape(),
                    None => emitter.values().shape().unwrap_or_default(),
                }
            }
            RadiometricParameter::MeanCosine(id) => Chart::of_mean_cosine(scene.medium(id)).shape(),
            RadiometricParameter::Emission(_) | RadiometricParameter::Exposure => Vec::new(),
        }
    }

    /// Finds out whether a scene has the medium, object or emitter.
    fn exists(&self, scene: &Scene) -> Result<(), DerivativeError> {
        let (what, number, count) = match *self {
            RadiometricParameter::Extinction(id)
            | RadiometricParameter::Albedo(id)
            | RadiometricParameter::Absorption(id)
            | RadiometricParameter::Scattering(id)
            | RadiometricParameter::MeanCosine(id) => ("medium", id, scene.media().len()),
            RadiometricParameter::Colour(object, _) => ("object", object, scene.objects().len()),
            RadiometricParameter::Emission(emitter) | RadiometricParameter::Radiance(emitter) => {
                ("emitter", emitter, scene.emitters().len())
            }
            RadiometricParameter::Exposure => return Ok(()),
        };
        if number < count {
            Ok(())
        } else {
            Err(DerivativeError::Missing { what, number })
        }
    }

    /// Finds out whether a scene of so many channels has the derivative.
    fn check(&self, scene: &Scene, channels: usize) -> Result<(), DerivativeError> {
        self.exists(scene)?;
        let has = |id: MediumId, quantities: &[Quantity]| {
            let lacking = |q: &&Quantity| !q.is_positive(scene.medium(id), channels);
            match quantities.iter().find(lacking) {
                Some(quantity) => Err(quantity.zero(scene, id)),
                None => Ok(()),
            }
        };
        match *self {
            RadiometricParameter::Emission(_) | RadiometricParameter::Exposure => Ok(()),
            RadiometricParameter::Absorption(id) if emits(scene, id) => {
                has(id, &[Quantity::Extinction, Quantity::Absorption])
            }
            RadiometricParameter::Absorption(_) => Ok(()),
            RadiometricParameter::Extinction(id)
                if scene.medium(id).albedo.is_zero() && !emits(scene, id) =>
            {
                Ok(())
            }
            RadiometricParameter::Extinction(id) => has(id, &[Quantity::Extinction]),
            RadiometricParameter::Albedo(id) if emits(scene, id) => {
                has(id, &[Quantity::Albedo, Quantity::Absorption])
            }
            RadiometricParameter::Albedo(id) => has(id, &[Quantity::Albedo]),
            RadiometricParameter::Scattering(id) => {
                has(id, &[Quantity::Extinction, Quantity::Scattering])
            }
            RadiometricParameter::MeanCosine(id) if scene.medium(id).phase.has_mean_cosine() => {
                Ok(())
            }
            RadiometricParameter::MeanCosine(id) => {
                Err(DerivativeError::Phase(scene.medium(id).name.clone()))
            }
            RadiometricParameter::Colour(object, tint) => {
                check_colour(&scene.objects()[object], tint, channels)
            }
            RadiometricParameter::Radiance(index) => check_radiance(scene, index, channels),
        }
    }
}

/// Finds out whether a surface has derivatives by a colour.
fn check_colour(object: &Object, tint: Tint, channels: usize) -> Result<(), DerivativeError> {
    let (name, bsdf) = (object.name.clone(), &object.bsdf);
    let what = tint.name();
    let Some(colours) = bsdf.tint(tint) else {
        let others = Tint::ALL.into_iter().filter(|t| bsdf.tint(*t).is_some());
        let others = others.map(Tint::name).collect();
        return Err(DerivativeError::Colour { what, name, others });
    };
    if colours.shape().is_none() {
        return Err(DerivativeError::Texture { what, name });
    }
    let is_positive = |value: Spectrum| value.0[..channels].iter().all(|c| *c > 0.0);
    if colours.values().all(is_positive) {
        return Ok(());
    }
    let instead = "";
    Err(DerivativeError::Zero {
        what,
        name,
        instead,
    })
}

/// Finds out whether an emitter has derivatives by what it is made up of.
fn check_radiance(scene: &Scene, index: usize, channels: usize) -> Result<(), DerivativeError> {
    let emitter = &scene.emitters()[index];
    let is_positive = match emitting_medium(emitter) {
        Some(id) => {
            let emission = scene.medium(id).emission.as_ref();
            emission.is_some_and(|emission| least(emission, channels) > 0.0)
        }
        None => {
            let values = emitter.values();
            if values.shape().is_none() {
                return Err(DerivativeError::Radiance(index));
            }
            values.are_positive(channels)
        }
    };
    if is_positive {
        Ok(())
    } else {
        Err(DerivativeError::Dim(index))
    }
}

/// The medium whose light an emitter is.
fn emitting_medium(emitter: &Emitter) -> Option<MediumId> {
    match emitter.values() {
        EmitterValues::Voxels(volume) => volume.medium(),
        _ => None,
    }
}

/// Whether a medium emits.
fn emits(scene: &Scene, id: MediumId) -> bool {
    let mut media = scene.emitters().iter().filter_map(emitting_medium);
    media.any(|medium| medium == id)
}

/// What must not be zero.
enum Quantity {
    Extinction,
    Albedo,
    Scattering,
    Absorption,
}

impl Quantity {
    fn is_positive(&self, medium: &Medium, channels: usize) -> bool {
        match self {
            Quantity::Extinction => least(&medium.sigma_t, channels) * medium.scale > 0.0,
            Quantity::Albedo | Quantity::Scattering => least(&medium.albedo, channels) > 0.0,
            Quantity::Absorption => largest(&medium.albedo, channels) < 1.0,
        }
    }

    fn zero(&self, scene: &Scene, id: MediumId) -> DerivativeError {
        let absorption = if emits(scene, id) {
            ""
        } else {
            ", or ask for sigma_a"
        };
        let (what, instead) = match self {
            Quantity::Extinction => ("sigma_t", absorption),
            Quantity::Albedo => ("the albedo", ""),
            Quantity::Scattering => ("sigma_s", absorption),
            Quantity::Absorption => ("sigma_a, which makes light,", ""),
        };
        DerivativeError::Zero {
            what,
            name: scene.medium(id).name.clone(),
            instead,
        }
    }
}

/// Where the sums of parameters lie, and what each factor of a path adds to.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(super) media: Vec<MediumPlan>,
    /// For each object, what its surface adds to.
    pub(super) objects: Vec<Vec<ColourPlan>>,
    /// Whether panes or filters that light passes on its way add to something.
    pub(super) has_panes: bool,
    /// For each emitter, where its sums begin.
    pub(super) emitters: Vec<EmitterPlan>,
    /// Where the sums of the exposure begin.
    pub(super) exposure: Option<usize>,
    /// Number of channels, whose sums are interleaved.
    pub(super) channels: usize,
    /// Where the sums of each parameter begin, and the number of all.
    pub(crate) starts: Vec<usize>,
    /// For each parameter, where sums begin that it shares with others: those of what attenuates.
    shared: Vec<Option<usize>>,
    /// Number of all sums in a row, those that are shared included.
    stride: usize,
}

/// What factors of a surface add to, by one of its colours.
#[derive(Clone, Debug)]
pub(super) struct ColourPlan {
    pub tint: Tint,
    /// Its values.
    pub colours: Texture,
    /// Where sums begin.
    pub start: usize,
}

/// What factors of a medium add to.
#[derive(Clone, Debug)]
pub(super) struct MediumPlan {
    /// How the extinction is made up.
    pub chart: Chart,
    /// How the albedo is.
    pub albedo_chart: Chart,
    /// How what it emits is.
    pub emission_chart: Chart,
    /// How the mean cosine is.
    pub mean_cosine_chart: Chart,
    /// Where sums begin, of what is asked for.
    pub extinction: Option<usize>,
    pub albedo: Option<usize>,
    pub absorption: Option<usize>,
    pub scattering: Option<usize>,
    /// Where those of attenuation begin: of the only one of these three that is asked for, or shared.
    pub attenuation: Option<usize>,
    pub mean_cosine: Option<usize>,
}

/// What the light of an emitter adds to: where sums begin, of what is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EmitterPlan {
    /// Of a factor on all of it.
    pub factor: Option<usize>,
    /// Of what it is made up of.
    pub values: Option<usize>,
}

impl Plan {
    /// For parameters of a scene of so many channels.
    pub(crate) fn new(
        scene: &Scene,
        parameters: &[RadiometricParameter],
        channels: usize,
    ) -> Result<Self, DerivativeError> {
        let media = scene.media().iter().map(|medium| MediumPlan {
            chart: Chart::of_extinction(medium),
            albedo_chart: Chart::of_albedo(medium),
            emission_chart: Chart::of_emission(medium),
            mean_cosine_chart: Chart::of_mean_cosine(medium),
            extinction: None,
            albedo: None,
            absorption: None,
            scattering: None,
            attenuation: None,
            mean_cosine: None,
        });
        let mut plan = Plan {
            media: media.collect(),
            objects: vec![Vec::new(); scene.objects().len()],
            has_panes: false,
            emitters: vec![EmitterPlan::default(); scene.emitters().len()],
            exposure: None,
            channels,
            starts: vec![0],
            shared: vec![None; parameters.len()],
            stride: 0,
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
                RadiometricParameter::Colour(object, tint) => {
                    let bsdf = &scene.objects()[object].bsdf;
                    plan.has_panes |= bsdf.is_partial();
                    plan.objects[object].extend(bsdf.tint(tint).map(|colours| ColourPlan {
                        tint,
                        colours,
                        start: next,
                    }));
                }
                RadiometricParameter::Emission(emitter) => plan.emitters[emitter].factor = start,
                RadiometricParameter::Radiance(emitter) => plan.emitters[emitter].values = start,
                RadiometricParameter::Exposure => plan.exposure = start,
            }
            next += channels * parameter.shape(scene).iter().product::<usize>();
            plan.starts.push(next);
        }
        plan.stride = next;
        (0..plan.media.len()).for_each(|id| plan.share_attenuation(id, parameters));
        Ok(plan)
    }

    /// Attenuation means the same to extinction, absorption and scattering: they share its sums.
    fn share_attenuation(&mut self, id: MediumId, parameters: &[RadiometricParameter]) {
        let attenuate = [
            RadiometricParameter::Extinction(id),
            RadiometricParameter::Absorption(id),
            RadiometricParameter::Scattering(id),
        ];
        let all = parameters.iter().enumerate();
        let asked = all.filter(|(_, parameter)| attenuate.contains(parameter));
        let asked: Vec<usize> = asked.map(|(i, _)| i).collect();
        self.media[id].attenuation = match asked[..] {
            [] => None,
            [only] => Some(self.starts[only]),
            [first, ..] => {
                let start = self.stride;
                self.stride += self.starts[first + 1] - self.starts[first];
                asked.iter().for_each(|i| self.shared[*i] = Some(start));
                Some(start)
            }
        };
    }

    /// Number of channels, whose sums are interleaved.
    pub(crate) fn channels(&self) -> usize {
        self.channels
    }

    /// Number of all sums in a row, those that parameters share included.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Where the sums of a parameter are in a row, and those that it shares with others.
    pub(crate) fn places(&self, parameter: usize) -> (Range<usize>, Option<Range<usize>>) {
        let own = self.starts[parameter]..self.starts[parameter + 1];
        let shared = self.shared[parameter].map(|start| start..start + own.len());
        (own, shared)
    }

    /// Number of all derivatives.
    pub(crate) fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }
}
