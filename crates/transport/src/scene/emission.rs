//! Emitters of a scene: their power, and the choice of emitters for paths to start from or connect
//! to.

use super::Scene;
use super::group::EmitterChoice;
use super::light_bounds::Receiver;
use super::parts::{MediumId, Parts};
use crate::Spectrum;
use crate::connection_end::{ConnectionEnd, OnSurface};
use crate::emitter::{Class, Emitter, Environment, VolumeLight};
use crate::medium::Medium;
use glam::DVec3;

impl Scene {
    /// Returns the power of each emitter in the first `channels` channels, and zero in the others.
    pub fn powers(&self, channels: usize) -> impl Iterator<Item = Spectrum> {
        let white = Spectrum(std::array::from_fn(|c| f64::from(u8::from(c < channels))));
        let shape = |object: usize| &self.objects()[object].shape;
        let emitters = self.emitters().iter();
        emitters.map(move |e| e.power(self.around(), shape) * white)
    }

    /// Returns the standard error of the sum of [`Scene::powers`], for media whose power had to be
    /// estimated.
    pub fn power_error(&self, channels: usize) -> Spectrum {
        let white = Spectrum(std::array::from_fn(|c| f64::from(u8::from(c < channels))));
        let errors = self.emitters().iter().map(Emitter::power_error);
        let squares = errors.fold(Spectrum::ZERO, |sum, e| sum + e * e);
        squares.map(f64::sqrt) * white
    }

    /// Returns the classes that have emitters.
    pub(crate) fn classes(&self) -> impl Iterator<Item = Class> + '_ {
        self.lights.classes()
    }

    /// Returns true if randomly scattered paths can hit an emitter.
    pub(crate) fn emitters_can_be_met(&self) -> bool {
        self.classes()
            .any(|class| matches!(class, Class::Area | Class::Sky))
    }

    /// Returns true if some emitter of a class is an image.
    pub(crate) fn has_image(&self, class: Class) -> bool {
        self.lights.has_image(class)
    }

    /// Returns the choice of an emitter of a class to connect a receiver to. The class must have
    /// emitters.
    pub(crate) fn emitter_choice<'a>(
        &'a self,
        class: Class,
        receiver: &'a Receiver,
    ) -> EmitterChoice<'a> {
        self.lights.choice(class, self.emitters(), receiver)
    }

    /// Returns the probability that [`Scene::emitter_choice`] chooses `emitter` within its class.
    pub(crate) fn emitter_probability(&self, emitter: usize, receiver: &Receiver) -> f64 {
        self.lights.probability(emitter, self.emitters(), receiver)
    }

    /// Chooses an emitter for a light subpath to start from. Returns its index and the probability
    /// of the choice.
    pub(crate) fn choose_source(&self, u: f64) -> Option<(usize, f64)> {
        let pick = self.lights.sources()?.sample(u);
        Some((pick.index, pick.probability))
    }

    /// Returns the probability that [`Scene::choose_source`] chooses `emitter`.
    pub(crate) fn source_probability(&self, emitter: usize) -> f64 {
        self.lights.sources().map_or(0.0, |s| s.pdf(emitter))
    }

    /// Returns the environments and their indices.
    pub(crate) fn environments(&self) -> impl Iterator<Item = (usize, &Environment)> {
        let emitters = self.parts.emitters.iter().enumerate();
        emitters.filter_map(|(i, e)| match e {
            Emitter::Environment(e) => Some((i, e)),
            _ => None,
        })
    }

    /// Returns the volumes that emit, and their indices.
    pub(crate) fn volume_lights(&self) -> impl Iterator<Item = (usize, &VolumeLight)> {
        let lights = self.volume_lights.iter();
        lights.filter_map(|&i| match &self.parts.emitters[i] {
            Emitter::Volume(volume) => Some((i, &**volume)),
            _ => None,
        })
    }

    /// Returns the light that leaves `start` in the unit `direction` from an end of an emitter: see
    /// [`Emitter::emitted`].
    pub fn leaving(
        &self,
        emitter: usize,
        end: &ConnectionEnd,
        start: DVec3,
        direction: DVec3,
    ) -> Spectrum {
        let emitter = &self.emitters()[emitter];
        match emitter {
            Emitter::Volume(volume) => match volume.medium() {
                Some(id) if self.fills(id, start) => self.medium(id).emitted(start),
                Some(_) => Spectrum::ZERO,
                None => volume.radiance(start),
            },
            _ => emitter.emitted(end, start, direction),
        }
    }

    /// Returns ε of a volume at a point of a medium, the light that a ray gains per length.
    pub(crate) fn emitted_within(
        &self,
        volume: &VolumeLight,
        medium: MediumId,
        x: DVec3,
    ) -> Spectrum {
        match volume.medium() {
            None => volume.radiance(x),
            Some(id) if id == medium => self.medium(id).emitted(x),
            Some(_) => Spectrum::ZERO,
        }
    }

    /// Returns true if a medium is at a point.
    fn fills(&self, id: MediumId, x: DVec3) -> bool {
        self.medium_at(x) == id && !self.is_displaced(id, x)
    }

    /// Returns the emitter that covers a surface, the radiance that leaves the surface in
    /// `direction`, and the density per unit area with which connections choose the point. Returns
    /// `None` if no light leaves.
    pub(crate) fn emitted(
        &self,
        on: &OnSurface,
        direction: DVec3,
    ) -> Option<(usize, Spectrum, f64)> {
        let object = &self.objects()[on.object];
        let emitter = object.emitter?;
        let (radiance, pdf) = self.emitters()[emitter].on_surface(&object.shape, &on.site)?;
        let shines = on.normal.dot(direction) > 0.0 && !radiance.is_zero();
        shines.then_some((emitter, radiance, pdf))
    }
}

/// Returns the indices of the volumes that emit. They are stored because rays need them often, and
/// there may be thousands of other emitters.
pub(super) fn volume_lights(parts: &Parts) -> Vec<usize> {
    let emitters = parts.emitters.iter().enumerate();
    let volumes = emitters.filter(|(_, e)| e.class() == Class::Volume);
    volumes.map(|(i, _)| i).collect()
}

/// Returns the positions of point-like emitters, if any medium scatters their light.
pub(super) fn point_like_emitters(parts: &Parts) -> Vec<DVec3> {
    // Planted error "point light in fog without care for 1/r²", found by morgana-io/io::reference::fog_around_a_point_light:
    // if parts.media.iter().any(Medium::scatters) {
    if !parts.media.iter().any(Medium::scatters) {
        return Vec::new();
    }
    parts
        .emitters
        .iter()
        .filter_map(Emitter::singularity)
        .collect()
}
