//! Media that emit, as emitters with light subpaths from their points
//! (docs/theory.md#media-that-emit).

use super::containment::Containment;
use super::emitted_power::integral;
use super::parts::{AMBIENT, MediumId, Parts};
use crate::Spectrum;
use crate::emitter::{Emitter, VolumeLight};
use crate::medium::Medium;
use crate::shape::Shape;
use crate::volume::{GridFilter, GridSamples, VolumeGrid, VolumeTexture};
use eikonal::Aabb;
use eikonal::field::Placement;
use glam::{DAffine3, DMat3, DVec3};

/// Number of points along each axis at which the light of a medium is evaluated.
const POINTS: usize = 32;
/// Smallest estimate relative to the mean, because the light between the points is unknown.
const MIN_RELATIVE_ESTIMATE: f64 = 0.05;

impl Parts {
    /// Adds an emitter for each medium that emits and has no emitter yet.
    /// [`Scene::new`](super::Scene::new) does so, too.
    pub fn with_emissive_media(mut self) -> Self {
        let emits = |id: &MediumId| self.media[*id].emission.is_some() && !self.has_emitter(*id);
        let emitting: Vec<MediumId> = (0..self.media.len()).filter(emits).collect();
        if emitting.is_empty() {
            return self;
        }
        let bodies = self.bodies();
        let containment = self.containment(&bodies);
        let lights = emitting.into_iter();
        let lights = lights.filter_map(|id| volume_light(&self, containment, id));
        let lights: Vec<Emitter> = lights.map(|light| Emitter::Volume(light.into())).collect();
        self.emitters.extend(lights);
        self
    }

    /// Returns true if one of the emitters is the light of a medium.
    pub(super) fn has_emitter(&self, id: MediumId) -> bool {
        let is = |e: &Emitter| matches!(e, Emitter::Volume(v) if v.medium() == Some(id));
        self.emitters.iter().any(is)
    }
}

/// Makes the emitter of a medium; `None` if the medium has no bounds, or its emission is not
/// finite.
fn volume_light(parts: &Parts, containment: Containment, id: MediumId) -> Option<VolumeLight> {
    let bounds = bounds(parts, id)?;
    let at = |k: usize| {
        let unit = [k % POINTS, k / POINTS % POINTS, k / POINTS / POINTS];
        let unit = DVec3::from(unit.map(|i| (i as f64 + 0.5) / POINTS as f64));
        let x = bounds.min + unit * (bounds.max - bounds.min);
        let here = containment.medium_at(x) == id;
        if here {
            parts.media[id].emitted(x)
        } else {
            Spectrum::ZERO
        }
    };
    let seen: Vec<Spectrum> = (0..POINTS.pow(3)).map(at).collect();
    let sum = seen.iter().fold(Spectrum::ZERO, |a, b| a + *b);
    let floor = if sum.is_zero() {
        brightest(&parts.media[id])
    } else {
        sum * (MIN_RELATIVE_ESTIMATE / seen.len() as f64)
    };
    let guess = seen
        .iter()
        .flat_map(|light| light.zip(floor, f64::max).0.map(|v| v as f32));
    let samples = GridSamples {
        size: [POINTS; 3],
        channels: Spectrum::CHANNELS,
        data: guess.collect(),
    };
    let to_world =
        DAffine3::from_mat3_translation(DMat3::from_diagonal(bounds.max - bounds.min), bounds.min);
    let allowed = [0.0, f64::MAX];
    let grid = VolumeGrid::new(
        samples,
        to_world,
        Placement::Centers,
        GridFilter::Trilinear,
        allowed,
    );
    VolumeLight::of_medium(id, grid.ok()?, integral(parts, containment, id, &bounds)).ok()
}

/// Returns an upper bound of the emission of a medium, without the factor of its index.
fn brightest(medium: &Medium) -> Spectrum {
    let emission = medium.emission.as_ref().map_or(0.0, |e| e.range().1);
    Spectrum::splat(medium.sigma_t.range().1 * medium.scale * emission)
}

/// Returns a box around all of a medium that may emit.
fn bounds(parts: &Parts, id: MediumId) -> Option<Aabb> {
    let held = held(parts, id);
    let grid = match &parts.media[id].sigma_t {
        VolumeTexture::Grid(grid) => Some(grid.aabb()),
        VolumeTexture::Uniform(_) => None,
    };
    match (held, grid) {
        (Some(held), Some(grid)) => {
            let both = Aabb::new(held.min.max(grid.min), held.max.min(grid.max));
            Some(if both.is_empty() { held } else { both })
        }
        (held, grid) => held.or(grid),
    }
}

/// Returns a box around the shapes that hold a medium; `None` if the medium extends beyond them.
fn held(parts: &Parts, id: MediumId) -> Option<Aabb> {
    if id == AMBIENT {
        return None;
    }
    let divided = parts.partitions.iter().filter_map(|p| {
        let mut sides = parts.objects[p.objects.clone()]
            .iter()
            .filter_map(|o| o.sides);
        let holds = id != p.exterior && sides.any(|s| s.interior == id || s.exterior == id);
        holds.then(|| p.aabb(&parts.objects))
    });
    let divides = |i: usize| parts.partitions.iter().any(|p| p.objects.contains(&i));
    let holders = || {
        let objects = parts.objects.iter().enumerate();
        objects.filter_map(|(i, o)| (o.interior() == Some(id) && !divides(i)).then_some(&o.shape))
    };
    if holders().any(|shape| !shape.is_closed()) {
        return None;
    }
    divided
        .chain(holders().map(Shape::aabb))
        .reduce(Aabb::union)
}
