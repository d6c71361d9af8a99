//! Divided volumes with faces of voxels as surfaces, prepared for walks from voxel to voxel
//! (docs/theory.md#walks-through-voxels).

use super::Scene;
use super::matter::{Matter, Matters};
use super::parts::{MediumId, Object, Partition, Parts};
use crate::bsdf::Bsdf;
use crate::shape::Shape;
use crate::shared::Distinct;
use crate::volume::{LabelGrid, VoxelMedia};
use eikonal::Aabb;
use glam::{DAffine3, DMat3, DVec3};
use std::ops::Range;
use std::sync::Arc;

/// Matter number that marks voxels with unsuitable or unknown matter.
const OTHER: u8 = u8::MAX;
/// Largest cosine, by rounding, between edges of voxels that are at right angles.
const MAX_COSINE: f64 = 1e-12;
/// Distance from other surfaces, in voxels, within which walks do not use voxels.
const SURFACE_MARGIN: f64 = 1e-6;

/// A volume of rectangular voxels, each with matter of one index and uniform coefficients. At all
/// faces between voxels of different media, light is refracted, or passes straight on.
#[derive(Clone, Debug)]
pub struct VoxelVolume {
    size: [usize; 3],
    /// Matter number of each voxel, x fastest, or [`OTHER`].
    numbers: Arc<Vec<u8>>,
    matters: Vec<VoxelMatter>,
    /// Objects that are faces of the volume.
    objects: Range<usize>,
    /// Medium around the volume, and its index, if the index is uniform and known.
    exterior: MediumId,
    exterior_n: Option<f64>,
    refracts: bool,
    to_world: DAffine3,
    to_voxels: DAffine3,
    from_voxels: DAffine3,
    /// Unit vectors along the edges of voxels.
    axes: DMat3,
    /// Reciprocal lengths of the edges of voxels.
    per_length: DVec3,
}

/// Matter and medium of a voxel.
#[derive(Clone, Debug)]
pub(crate) struct VoxelMatter {
    pub matter: Matter,
    pub medium: MediumId,
}

/// Space beyond a face.
#[derive(Clone, Copy, Debug)]
pub(crate) enum BeyondFace<'a> {
    /// A voxel.
    Voxel(usize, &'a VoxelMatter),
    /// The medium around the volume, and its index.
    Exterior(MediumId, f64),
    /// Space with other properties, or near other surfaces.
    Unknown,
}

/// The divided volumes of a scene through which walks can go from voxel to voxel.
#[derive(Clone, Debug)]
pub(super) struct VoxelVolumes {
    list: Vec<VoxelVolume>,
    /// For each medium, the volume to whose voxels the medium belongs, if any.
    of_medium: Vec<Option<usize>>,
}

impl VoxelVolumes {
    fn of(scene: &Scene) -> Self {
        let (parts, matters) = (&scene.parts, scene.matters());
        let mut volumes = VoxelVolumes {
            list: Vec::new(),
            of_medium: vec![None; parts.media.len()],
        };
        for number in 0..parts.partitions.len() {
            let Some(mut volume) =
                VoxelVolume::of(parts, matters, number, &scene.geometry.walk_grids)
            else {
                continue;
            };
            // If other objects lie near the volume, the medium around it varies.
            if volume
                .objects
                .clone()
                .any(|face| scene.geometry.overlapping[face])
            {
                volume.exterior_n = None;
            }
            for held in &volume.matters {
                volumes.of_medium[held.medium] = Some(volumes.list.len());
            }
            volumes.list.push(volume);
        }
        volumes
    }
}

impl Scene {
    /// Returns the grid of the voxels of a medium: of labels, or of a volume that surfaces along
    /// voxels divide into media.
    pub(crate) fn voxels_of(&self, medium: MediumId) -> Option<Arc<LabelGrid>> {
        let voxels = self.parts.partitions.iter();
        let mut voxels = voxels.filter_map(|partition| partition.voxels.as_ref());
        let voxels = voxels.find(|voxels| voxels.media().contains(&medium));
        let labels = self.medium(medium).labels.as_ref();
        voxels
            .map(|voxels| voxels.parts().clone())
            .or_else(|| labels.map(|labels| labels.grid().clone()))
    }

    /// Returns the volume to whose voxels a medium belongs, if walks can go through it from voxel
    /// to voxel.
    #[inline]
    pub(crate) fn voxel_volume(&self, medium: MediumId) -> Option<&VoxelVolume> {
        let volumes = self.voxel_volumes.get_or_init(|| VoxelVolumes::of(self));
        Some(&volumes.list[volumes.of_medium[medium]?])
    }
}

impl VoxelVolume {
    /// Prepares a divided volume. Returns `None` unless its faces are faces of rectangular voxels
    /// that refract all light or transmit all light straight on.
    fn of(
        parts: &Parts,
        matters: &Matters,
        number: usize,
        grids: &Distinct<Vec<u8>>,
    ) -> Option<Self> {
        let partition = &parts.partitions[number];
        let voxels = partition.voxels.as_ref()?;
        let refracts = refracts(&parts.objects[partition.objects.clone()])?;
        let grid = matters.voxels_of(number)?;
        let (size, to_world) = (grid.size(), grid.to_world());
        let cells = DVec3::from_array(size.map(|n| n as f64));
        let (axes, per_length) = edges(&to_world, cells)?;
        let held = held(parts, matters, partition, voxels);
        let number_of = |matter: usize| {
            let place = held.iter().position(|(number, _)| *number == matter);
            place.and_then(|i| u8::try_from(i).ok()).unwrap_or(OTHER)
        };
        let numbers: [u8; 256] = std::array::from_fn(number_of);
        let exterior = &parts.media[partition.exterior];
        let is_constant = exterior.index.is_constant();
        let mut volume = VoxelVolume {
            size,
            numbers: Arc::default(),
            matters: held.into_iter().map(|(_, matter)| matter).collect(),
            objects: partition.objects.clone(),
            exterior: partition.exterior,
            exterior_n: is_constant.then(|| exterior.index.n(DVec3::ZERO)),
            refracts,
            to_world,
            to_voxels: DAffine3::from_scale(cells) * to_world.inverse(),
            from_voxels: to_world * DAffine3::from_scale(1.0 / cells),
            axes,
            per_length,
        };
        let matters = grid.labels().iter().map(|m| numbers[usize::from(*m)]);
        let mut numbers: Vec<u8> = matters.collect();
        for (i, object) in parts.objects.iter().enumerate() {
            if !partition.objects.contains(&i) {
                volume.mark_unsuitable(&object.shape, &mut numbers);
            }
        }
        volume.numbers = grids.intern(numbers);
        Some(volume)
    }

    /// Excludes the voxels through which a surface may pass.
    fn mark_unsuitable(&self, shape: &Shape, numbers: &mut [u8]) {
        shape.each_patch(|points| self.mark_unsuitable_around(points, numbers));
    }

    /// Excludes the voxels near a box around points.
    fn mark_unsuitable_around(&self, points: &[DVec3], numbers: &mut [u8]) {
        let places = points.iter().map(|p| self.to_voxels.transform_point3(*p));
        let filled = Aabb::around(places);
        if !(filled.min.is_finite() && filled.max.is_finite()) {
            numbers.fill(OTHER);
            return;
        }
        let (first, end) = (filled.min - SURFACE_MARGIN, filled.max + SURFACE_MARGIN);
        let range = |axis: usize| {
            let n = self.size[axis] as f64;
            let end = (end[axis].floor() + 1.0).clamp(0.0, n) as usize;
            (first[axis].floor().clamp(0.0, n) as usize).min(end)..end
        };
        let [x, y, z] = [range(0), range(1), range(2)];
        for row in z.flat_map(|k| y.clone().map(move |j| (j, k))) {
            let first = self.size[0] * (row.0 + self.size[1] * row.1);
            numbers[first + x.start..first + x.end].fill(OTHER);
        }
    }

    /// Returns the number of voxels along x, y, z.
    pub(crate) fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the map from the unit cube to the world.
    pub(crate) fn to_world(&self) -> &DAffine3 {
        &self.to_world
    }

    /// Returns true if an object is a face of the volume.
    pub(crate) fn has_face(&self, object: usize) -> bool {
        self.objects.contains(&object)
    }

    /// Returns true if faces between media refract light, false if light passes straight on.
    pub(crate) fn refracts(&self) -> bool {
        self.refracts
    }

    /// Returns the reciprocal lengths of the edges of voxels.
    #[inline]
    pub(crate) fn voxels_per_length(&self) -> DVec3 {
        self.per_length
    }

    /// Converts a position in the world to units of voxels from the corner of the first voxel.
    pub(crate) fn in_voxels(&self, x: DVec3) -> DVec3 {
        self.to_voxels.transform_point3(x)
    }

    /// Converts a position in voxels to the world: the inverse of [`VoxelVolume::in_voxels`].
    pub(crate) fn in_world(&self, p: DVec3) -> DVec3 {
        self.from_voxels.transform_point3(p)
    }

    /// Converts a unit vector of the world to components along the edges of voxels.
    pub(crate) fn along_edges(&self, direction: DVec3) -> DVec3 {
        self.axes.transpose() * direction
    }

    /// Converts components along edges to a unit vector of the world: the inverse of
    /// [`VoxelVolume::along_edges`].
    pub(crate) fn direction(&self, along_edges: DVec3) -> DVec3 {
        (self.axes * along_edges).normalize()
    }

    /// Returns the matter of a voxel, if it is known.
    #[inline]
    pub(crate) fn matter(&self, voxel: usize) -> Option<&VoxelMatter> {
        self.matters.get(usize::from(self.numbers[voxel]))
    }

    /// Returns the space beyond the face of a voxel across an axis. `low` is the position of the
    /// voxel's lowest corner.
    #[inline]
    pub(crate) fn beyond(&self, voxel: usize, low: DVec3, axis: usize, up: bool) -> BeyondFace<'_> {
        let stride = [1, self.size[0], self.size[0] * self.size[1]][axis];
        let is_last = if up {
            low[axis] + 1.0 >= self.size[axis] as f64
        } else {
            low[axis] <= 0.0
        };
        if is_last {
            return match self.exterior_n {
                Some(n) => BeyondFace::Exterior(self.exterior, n),
                None => BeyondFace::Unknown,
            };
        }
        let next = if up { voxel + stride } else { voxel - stride };
        match self.matter(next) {
            Some(matter) => BeyondFace::Voxel(next, matter),
            None => BeyondFace::Unknown,
        }
    }
}

/// Returns true if all faces refract light, and false if all transmit it straight on. Returns
/// `None` for other faces.
fn refracts(faces: &[Object]) -> Option<bool> {
    let is_bare = faces.iter().all(|face| face.emitter.is_none());
    let clear = |face: &Object| matches!(&face.bsdf, Bsdf::Dielectric(d) if d.is_clear());
    if is_bare && faces.iter().all(clear) {
        return Some(true);
    }
    let passes = |face: &Object| matches!(face.bsdf, Bsdf::Null);
    (is_bare && faces.iter().all(passes)).then_some(false)
}

/// Returns unit vectors along the edges of voxels and the reciprocal lengths of the edges, if the
/// edges are at right angles.
fn edges(to_world: &DAffine3, cells: DVec3) -> Option<(DMat3, DVec3)> {
    let sides = to_world.matrix3;
    let lengths = DVec3::new(
        sides.x_axis.length(),
        sides.y_axis.length(),
        sides.z_axis.length(),
    );
    let axes = sides * DMat3::from_diagonal(1.0 / lengths);
    let cosines = [
        axes.x_axis.dot(axes.y_axis),
        axes.y_axis.dot(axes.z_axis),
        axes.z_axis.dot(axes.x_axis),
    ];
    let is_square = cosines.iter().all(|cos| cos.abs() < MAX_COSINE);
    is_square.then(|| (axes, cells / lengths))
}

/// Returns the matter with uniform scattering of the media of a divided volume, each with its
/// number among all matter.
fn held(
    parts: &Parts,
    matters: &Matters,
    partition: &Partition,
    voxels: &VoxelMedia,
) -> Vec<(usize, VoxelMatter)> {
    let media = voxels.media().iter().copied();
    let media = media.filter(|m| *m != partition.exterior && *m < parts.media.len());
    let of_medium = |medium| {
        let numbered = matters.own(medium).into_iter();
        numbered.filter_map(move |number| {
            let matter = matters.numbered(number);
            let held = VoxelMatter {
                matter: matter.clone(),
                medium,
            };
            matter.phase.is_uniform().then_some((number, held))
        })
    };
    media.flat_map(of_medium).collect()
}
