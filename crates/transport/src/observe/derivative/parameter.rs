//! Parameters by which light is differentiated.

use super::DerivativeError;
use super::chart::{Chart, largest, least};
use crate::Spectrum;
use crate::bsdf::Tint;
use crate::emitter::{Emitter, EmitterValues};
use crate::medium::Medium;
use crate::scene::{MediumId, Object, Scene};
use crate::texture::Texture;
use std::ops::Range;

/// Parameter by which light is differentiated. It has one or more numbers, each with a value for
/// each channel.
///
/// Coefficients of media are per unit length and include the medium's `scale`. Their numbers depend
/// on the medium's extinction (for the albedo, on its albedo):
///
/// - one number if it is uniform,
/// - one for each label,
/// - one for each voxel, [z, y, x].
///
/// Colours, and emitters that project a texture, have
///
/// - one number,
/// - one for each pixel of an image, [y, x],
/// - one for each vertex or triangle of a coloured mesh,
/// - or one for each of the two colours of a checkerboard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RadiometricParameter {
    /// Extinction σ_t of a medium, at constant albedo.
    Extinction(MediumId),
    /// Albedo of a medium, at constant extinction.
    Albedo(MediumId),
    /// Absorption coefficient μ_a of a medium, at constant scattering coefficient.
    Absorption(MediumId),
    /// Scattering coefficient μ_s of a medium, at constant absorption coefficient.
    Scattering(MediumId),
    /// Absorption coefficient μ_a of each voxel of a medium of labels, at constant scattering
    /// coefficient: [z, y, x] of the labels, zero where other media are.
    VoxelAbsorption(MediumId),
    /// Scattering coefficient μ_s of each voxel of a medium of labels, at constant absorption
    /// coefficient.
    VoxelScattering(MediumId),
    /// Mean cosine g of a medium's Henyey–Greenstein phase function: one number, one for each
    /// label, or one for each voxel.
    MeanCosine(MediumId),
    /// [Colour](crate::bsdf::Bsdf::tint) of the surface of an object with this index: one number,
    /// or the numbers of a texture.
    Colour(usize, Tint),
    /// Factor on all emission of the emitter with this index; it is 1 in the scene.
    Emission(usize),
    /// Values of the light of the emitter with this index: its radiance, intensity or irradiance,
    /// or the power of a beam or fibre. For an image they are its pixels, for a volume its voxels.
    /// The emission of a medium has numbers like the medium's coefficients.
    Radiance(usize),
    /// Factor on all measured light; it is 1 in the scene.
    Exposure,
}

impl RadiometricParameter {
    /// Returns the length along each axis, without the channel axis. Empty if the scene has no such
    /// medium, object or emitter.
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
            RadiometricParameter::VoxelAbsorption(id)
            | RadiometricParameter::VoxelScattering(id) => {
                let voxels = scene.voxels_of(id);
                voxels.map_or_else(Vec::new, |voxels| Chart::of_voxels(&voxels).shape())
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

    /// Checks that the scene has the medium, object or emitter.
    fn exists(&self, scene: &Scene) -> Result<(), DerivativeError> {
        let (what, number, count) = match *self {
            RadiometricParameter::Extinction(id)
            | RadiometricParameter::Albedo(id)
            | RadiometricParameter::Absorption(id)
            | RadiometricParameter::Scattering(id)
            | RadiometricParameter::VoxelAbsorption(id)
            | RadiometricParameter::VoxelScattering(id)
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

    /// Checks that a scene of `channels` channels has the derivative.
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
            RadiometricParameter::VoxelAbsorption(id)
            | RadiometricParameter::VoxelScattering(id)
                if scene.voxels_of(id).is_none() =>
            {
                Err(DerivativeError::NoVoxels(scene.medium(id).name.clone()))
            }
            RadiometricParameter::VoxelAbsorption(id) => {
                RadiometricParameter::Absorption(id).check(scene, channels)
            }
            RadiometricParameter::VoxelScattering(id) => {
                RadiometricParameter::Scattering(id).check(scene, channels)
            }
            RadiometricParameter::Extinction(id)
            | RadiometricParameter::Absorption(id)
            | RadiometricParameter::Scattering(id)
                if scene.medium(id).phase.flakes().is_some() =>
            {
                Err(DerivativeError::Flakes(scene.medium(id).name.clone()))
            }
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

/// Returns the chart of a medium's extinction for the requested parameters.
fn extinction_chart(scene: &Scene, id: MediumId, parameters: &[RadiometricParameter]) -> Chart {
    let by_voxel = [
        RadiometricParameter::VoxelAbsorption(id),
        RadiometricParameter::VoxelScattering(id),
    ];
    let by_voxel = by_voxel.iter().any(|p| parameters.contains(p));
    let voxels = by_voxel.then(|| scene.voxels_of(id)).flatten();
    match voxels {
        Some(voxels) => Chart::of_voxels(&voxels),
        None => Chart::of_extinction(scene.medium(id)),
    }
}

/// Checks that coefficients of the medium of a voxel parameter are requested by voxel only.
fn check_voxels(
    scene: &Scene,
    parameter: &RadiometricParameter,
    parameters: &[RadiometricParameter],
) -> Result<(), DerivativeError> {
    let (RadiometricParameter::VoxelAbsorption(id) | RadiometricParameter::VoxelScattering(id)) =
        *parameter
    else {
        return Ok(());
    };
    let by_label = [
        RadiometricParameter::Extinction(id),
        RadiometricParameter::Absorption(id),
        RadiometricParameter::Scattering(id),
    ];
    if by_label.iter().any(|p| parameters.contains(p)) {
        return Err(DerivativeError::VoxelsAndLabels(
            scene.medium(id).name.clone(),
        ));
    }
    Ok(())
}

/// Checks that a surface has derivatives by a colour.
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

/// Checks that an emitter has derivatives by the values of its light.
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

/// Returns the medium whose emission an emitter represents.
fn emitting_medium(emitter: &Emitter) -> Option<MediumId> {
    match emitter.values() {
        EmitterValues::Voxels(volume) => volume.medium(),
        _ => None,
    }
}

/// Returns true if a medium emits.
fn emits(scene: &Scene, id: MediumId) -> bool {
    let mut media = scene.emitters().iter().filter_map(emitting_medium);
    media.any(|medium| medium == id)
}

/// Quantity that must not be zero.
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

/// Layout of the sums of all parameters, and the sums to which each factor of a path adds.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(super) media: Vec<MediumPlan>,
    /// Sums to which each object's surface adds.
    pub(super) objects: Vec<Vec<ColourPlan>>,
    /// True if panes or filters that light passes add to some sum.
    pub(super) has_panes: bool,
    /// Start of each emitter's sums.
    pub(super) emitters: Vec<EmitterPlan>,
    /// Start of the sums of the exposure.
    pub(super) exposure: Option<usize>,
    /// Number of channels; their sums are interleaved.
    pub(super) channels: usize,
    /// Start of the sums of each parameter, and the total number.
    pub(crate) starts: Vec<usize>,
    /// Start of the attenuation sums that each parameter shares with others.
    shared: Vec<Option<usize>>,
    /// Number of sums in a row, including shared ones.
    stride: usize,
}

/// Sums to which factors of a surface add, for one of its colours.
#[derive(Clone, Debug)]
pub(super) struct ColourPlan {
    pub tint: Tint,
    /// Values of the colour.
    pub colours: Texture,
    /// Start of the sums.
    pub start: usize,
}

/// Sums to which factors of a medium add.
#[derive(Clone, Debug)]
pub(super) struct MediumPlan {
    /// Degrees of freedom of the extinction.
    pub chart: Chart,
    /// Degrees of freedom of the albedo.
    pub albedo_chart: Chart,
    /// Degrees of freedom of the emission.
    pub emission_chart: Chart,
    /// Degrees of freedom of the mean cosine.
    pub mean_cosine_chart: Chart,
    /// Starts of the sums of the requested parameters.
    pub extinction: Option<usize>,
    pub albedo: Option<usize>,
    pub absorption: Option<usize>,
    pub scattering: Option<usize>,
    /// Start of the attenuation sums: the sums of the only requested one of extinction, absorption
    /// and scattering, or shared ones.
    pub attenuation: Option<usize>,
    pub mean_cosine: Option<usize>,
}

/// Sums to which the light of an emitter adds; each field is the start of the sums, if requested.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EmitterPlan {
    /// Start of the sum of a factor on all light of the emitter.
    pub factor: Option<usize>,
    /// Start of the sums of the values of the emitter's light.
    pub values: Option<usize>,
}

impl Plan {
    /// Creates the layout for parameters of a scene with `channels` channels.
    pub(crate) fn new(
        scene: &Scene,
        parameters: &[RadiometricParameter],
        channels: usize,
    ) -> Result<Self, DerivativeError> {
        let media = scene.media().iter().enumerate();
        let media = media.map(|(id, medium)| MediumPlan {
            chart: extinction_chart(scene, id, parameters),
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
            check_voxels(scene, parameter, parameters)?;
            let start = Some(next);
            match *parameter {
                RadiometricParameter::Extinction(id) => plan.media[id].extinction = start,
                RadiometricParameter::Albedo(id) => plan.media[id].albedo = start,
                RadiometricParameter::Absorption(id)
                | RadiometricParameter::VoxelAbsorption(id) => {
                    plan.media[id].absorption = start;
                }
                RadiometricParameter::Scattering(id)
                | RadiometricParameter::VoxelScattering(id) => {
                    plan.media[id].scattering = start;
                }
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

    /// Makes extinction, absorption and scattering share the sums of attenuation, whose derivative
    /// is the same by all three.
    fn share_attenuation(&mut self, id: MediumId, parameters: &[RadiometricParameter]) {
        let attenuate = [
            RadiometricParameter::Extinction(id),
            RadiometricParameter::Absorption(id),
            RadiometricParameter::Scattering(id),
            RadiometricParameter::VoxelAbsorption(id),
            RadiometricParameter::VoxelScattering(id),
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

    /// Returns the number of channels; their sums are interleaved.
    pub(crate) fn channels(&self) -> usize {
        self.channels
    }

    /// Returns the number of sums in a row, including shared ones.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// Returns the ranges in a row of a parameter's own sums and of the sums that it shares with
    /// others.
    pub(crate) fn places(&self, parameter: usize) -> (Range<usize>, Option<Range<usize>>) {
        let own = self.starts[parameter]..self.starts[parameter + 1];
        let shared = self.shared[parameter].map(|start| start..start + own.len());
        (own, shared)
    }

    /// Returns the number of derivatives.
    pub(crate) fn len(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }
}
