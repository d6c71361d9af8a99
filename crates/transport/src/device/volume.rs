//! Volumes of voxels for devices, and the reasons why a scene has none
//! (docs/theory.md#particles-on-a-device).

use crate::Bins;
use crate::meter::{Coordinates, Estimator, FluenceMeter, Meter};
use crate::phase::Phase;
use crate::scene::{AMBIENT, MediumId, Object, Scene, faces_refract};
use crate::shape::Shape;
use crate::volume::{LabelGrid, VoxelMedia};
use eikonal::field::SplineCoefficients;
use eikonal::{Aabb, Field};
use glam::{DAffine3, DMat3, DVec3};

/// Smallest contrast of the index that bends rays in single precision, relative to the index.
const MIN_CONTRAST: f64 = 1e-5;
/// Largest difference between the edges of a meter and the faces of a volume, relative to its size.
const PLACE_TOLERANCE: f64 = 1e-9;
/// Largest cosine between edges of a voxel that are at right angles.
const MAX_COSINE: f64 = 1e-12;
/// Length of a step along a curved ray, relative to the smallest edge of a voxel and the smallest
/// spacing of the index. In single precision the direction is wrong by 3e-6 per voxel.
const STEP: f64 = 0.5;
/// Largest number of voxels along an axis.
const MAX_SIZE: usize = 1 << 16;
/// Largest number of kinds of matter.
const MAX_LABELS: usize = 1 << 8;

/// Reason why a device cannot run a scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a GPU cannot run this scene: {0}; the CPU can")]
pub struct Unsuitable(pub String);

/// Box of voxels around which nothing else lies. Lengths are in units of [`DeviceVolume::unit`],
/// and positions in voxels.
#[derive(Clone, Debug)]
pub struct DeviceVolume {
    /// Number of voxels along x, y, z.
    pub size: [usize; 3],
    /// Index of the matter of each voxel, x fastest.
    pub labels: Vec<u8>,
    /// Matter by label.
    pub matter: Vec<DeviceMatter>,
    /// Scene units per unit of length: the smallest edge of a voxel.
    pub unit: f64,
    /// Voxels per unit of length, along each axis.
    pub per_length: DVec3,
    /// Index around the volume.
    pub exterior_n: f64,
    /// True if faces between different indices refract light, false if light passes straight on.
    pub refracts: bool,
    /// Index inside that bends rays, if it varies.
    pub index: Option<DeviceIndex>,
    /// Gates of the optical path length.
    pub gates: Gates,
    /// Label of the medium around the volume, if it also fills voxels.
    pub(super) around: Option<usize>,
    pub(super) frame: Frame,
    /// Media of the voxels, except the medium around the volume.
    pub(super) media: Vec<MediumId>,
}

/// Coordinates of voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Map from the world to voxels.
    pub to_cells: DAffine3,
    /// Unit vectors along the edges of voxels.
    pub axes: DMat3,
}

/// Matter of voxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceMatter {
    /// Refractive index; NaN if it varies.
    pub n: f64,
    /// Extinction coefficient σ_t per unit of length.
    pub extinction: f64,
    /// Albedo σ_s/σ_t.
    pub albedo: f64,
    /// Mean cosine g of the Henyey–Greenstein phase function.
    pub g: f64,
    /// Absorption coefficient μ_a per scene unit.
    pub absorption: f64,
}

/// Index n² = n_ref² + δ, with δ as a tricubic B-spline.
#[derive(Clone, Debug)]
pub struct DeviceIndex {
    /// Coefficients of δ.
    pub spline: SplineCoefficients,
    /// Map from positions in voxels to positions among the coefficients.
    pub to_spline: DAffine3,
    /// Length of a step along a ray, in units of length.
    pub step: f64,
}

/// Gates of the optical path length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates {
    /// Number of gates.
    pub count: usize,
    /// Width of a gate, in units of length; infinite if there is one gate for all light.
    pub width: f64,
    /// Start of the first gate, in units of length.
    pub(super) start: f64,
}

impl Gates {
    fn new(bins: Option<&Bins>, unit: f64) -> Self {
        match bins {
            None => Gates {
                count: 1,
                width: f64::INFINITY,
                start: f64::NEG_INFINITY,
            },
            Some(bins) => Gates {
                count: bins.count,
                width: bins.width() / unit,
                start: bins.min / unit,
            },
        }
    }
}

impl DeviceVolume {
    /// Prepares the voxels of a scene for its meters, in channel 0.
    ///
    /// # Errors
    /// Says what the scene or its meters have that devices do not support.
    pub fn of(scene: &Scene, meters: &[Meter], channels: usize) -> Result<Self, Unsuitable> {
        let meter = supported_meter(meters)?;
        if channels != 1 {
            return refuse("its channels share particles: give the film's group size 1");
        }
        if scene.instants() > 1 {
            return refuse("its sound has several instants");
        }
        if scene.fluoresces() {
            return refuse("its media fluoresce");
        }
        let ambient = scene.medium(AMBIENT);
        if !(ambient.index.is_constant() && ambient.is_transparent()) {
            return refuse("the medium around its voxels attenuates light or varies");
        }
        let solid = Solid::of(scene)?;
        if meter.grid.coordinates() != Coordinates::Cartesian || !solid.fits(meter) {
            return refuse(
                "the cells of its fluencemeter are not the voxels: give the meter the size and place of the volume",
            );
        }
        solid.prepare(meter)
    }

    /// Returns the number of voxels.
    pub fn voxels(&self) -> usize {
        self.labels.len()
    }

    /// Returns the number of slots of fluence: voxels times gates.
    pub fn slots(&self) -> usize {
        self.voxels().saturating_mul(self.gates.count)
    }

    /// Returns the absorption coefficient of a slot of fluence, per scene unit.
    pub(super) fn absorption(&self, slot: usize) -> f64 {
        let label = self.labels[slot % self.labels.len()];
        self.matter[usize::from(label)].absorption
    }
}

/// Checks that devices can run a scene with its meters, in all groups of channels.
///
/// # Errors
/// Says what the scene or its meters have that devices do not support.
pub fn check_device(scenes: &[Scene], meters: &[Meter]) -> Result<(), Unsuitable> {
    scenes.iter().enumerate().try_for_each(|(index, scene)| {
        let channels = scene.film().channels_of(index);
        DeviceVolume::of(scene, meters, channels).map(|_| ())
    })
}

fn refuse<T>(reason: impl Into<String>) -> Result<T, Unsuitable> {
    Err(Unsuitable(reason.into()))
}

/// Returns the only meter, if a device can serve it.
fn supported_meter(meters: &[Meter]) -> Result<&FluenceMeter, Unsuitable> {
    let meter = match meters {
        [Meter::Fluence(meter)] => meter,
        [Meter::Irradiance(_)] => return refuse("it has no fluencemeter"),
        _ => {
            return refuse(format!(
                "it has {} meters, and a GPU serves one fluencemeter: remove the others, such as detectors",
                meters.len()
            ));
        }
    };
    let unsupported = [
        (
            meter.estimator != Estimator::TrackLength,
            "its fluencemeter scores collisions",
        ),
        (
            meter.weight_windows && meter.optical_length.is_some(),
            "its fluencemeter uses weight windows: set weight_windows to false",
        ),
        (
            meter.sidebands.is_some(),
            "its fluencemeter separates sidebands",
        ),
        (
            meter.frequency_domain.is_some(),
            "its fluencemeter measures modulated light",
        ),
    ];
    match unsupported.iter().find(|(is_so, _)| *is_so) {
        Some((_, reason)) => refuse(*reason),
        None => Ok(meter),
    }
}

/// Body that fills the voxels.
struct Solid<'s> {
    scene: &'s Scene,
    /// Map from the unit cube to the world.
    to_world: DAffine3,
    /// Number of voxels, if the body has voxels.
    size: Option<[usize; 3]>,
    filling: Filling<'s>,
    /// Surfaces of the body.
    faces: &'s [Object],
}

/// Media of a body.
enum Filling<'s> {
    One(MediumId),
    Voxels(&'s VoxelMedia),
}

impl<'s> Solid<'s> {
    /// Finds the only body of a scene.
    fn of(scene: &'s Scene) -> Result<Self, Unsuitable> {
        let faces = scene.objects();
        if let [object] = faces
            && let Shape::Cube(cube) = &object.shape
        {
            let Some(sides) = object.sides.filter(|sides| sides.exterior == AMBIENT) else {
                return refuse("its cube holds no medium");
            };
            // From the unit cube instead of [−1, 1]³.
            let unit = DAffine3::from_mat3_translation(
                DMat3::from_diagonal(DVec3::splat(2.0)),
                DVec3::NEG_ONE,
            );
            return Ok(Solid {
                scene,
                to_world: cube.to_world() * unit,
                size: None,
                filling: Filling::One(sides.interior),
                faces,
            });
        }
        let partition = scene.sole_partition();
        let partition = partition.filter(|partition| partition.exterior == AMBIENT);
        let Some(voxels) = partition.and_then(|partition| partition.voxels()) else {
            return refuse("it needs one label volume, or one cube, and no other shape");
        };
        Ok(Solid {
            scene,
            to_world: voxels.parts().to_world(),
            size: Some(voxels.parts().size()),
            filling: Filling::Voxels(voxels),
            faces,
        })
    }

    /// Returns true if the cells of a meter are the voxels.
    fn fits(&self, meter: &FluenceMeter) -> bool {
        self.size.is_none_or(|size| size == meter.grid.size())
            && is_same_place(meter.grid.to_world(), &self.to_world)
    }

    fn prepare(&self, meter: &FluenceMeter) -> Result<DeviceVolume, Unsuitable> {
        let size = meter.grid.size();
        if size.into_iter().any(|n| n > MAX_SIZE) {
            return refuse(format!("it has more than {MAX_SIZE} voxels along an axis"));
        }
        let cells = DVec3::from_array(size.map(|n| n as f64));
        let sides = self.to_world.matrix3;
        let lengths = [sides.x_axis, sides.y_axis, sides.z_axis].map(DVec3::length);
        let lengths = DVec3::from_array(lengths);
        let axes = sides * DMat3::from_diagonal(1.0 / lengths);
        let cosines = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| axes.col(a).dot(axes.col(b)));
        if cosines.iter().any(|cos| cos.abs() > MAX_COSINE) {
            return refuse("its voxels are not at right angles");
        }
        let unit = (lengths / cells).min_element();
        let contents = self.contents(meter, unit)?;
        let from_cells = self.to_world * DAffine3::from_scale(1.0 / cells);
        let index = contents.index(self.scene, from_cells, unit)?;
        if let Some(index) = &index
            && !index.covers(cells)
        {
            return refuse("its index is sampled in a part of the volume only");
        }
        Ok(DeviceVolume {
            size,
            unit,
            per_length: unit * cells / lengths,
            exterior_n: self.scene.medium(AMBIENT).index.n(DVec3::ZERO),
            refracts: self.refracts(index.is_some())?,
            index,
            gates: Gates::new(meter.optical_length.as_ref(), unit),
            around: contents.first_label(AMBIENT),
            frame: Frame {
                to_cells: DAffine3::from_scale(cells) * self.to_world.inverse(),
                axes,
            },
            media: contents.inside().collect(),
            labels: contents.labels,
            matter: contents.matter,
        })
    }

    /// Returns true if faces refract light, false if light passes straight on. An index that varies
    /// is continuous across the faces inside.
    fn refracts(&self, bends: bool) -> Result<bool, Unsuitable> {
        let is_outer = |face: &&Object| {
            let sides = face.sides;
            sides.is_some_and(|sides| [sides.interior, sides.exterior].contains(&AMBIENT))
        };
        let outer: Vec<Object>;
        let faces = if bends {
            outer = self.faces.iter().filter(is_outer).cloned().collect();
            &outer[..]
        } else {
            self.faces
        };
        match faces_refract(self.scene.media(), faces, 1) {
            Some(refracts) => Ok(refracts),
            None => refuse("its faces neither refract all light nor let all pass straight on"),
        }
    }

    /// Returns the label of each voxel, and the matter of each label.
    fn contents(&self, meter: &FluenceMeter, unit: f64) -> Result<Contents, Unsuitable> {
        let mut contents = Contents::default();
        let around = match &self.filling {
            Filling::One(medium) => {
                contents.add(self.scene, *medium, meter, unit)?;
                None
            }
            Filling::Voxels(voxels) => {
                let media = voxels.media().iter();
                let inside = media.filter(|medium| **medium != AMBIENT);
                for medium in inside {
                    contents.add(self.scene, *medium, meter, unit)?;
                }
                let mut all = (0..meter.grid.cells()).map(|voxel| voxels.of_voxel(voxel));
                all.any(|medium| medium.is_none_or(|medium| medium == AMBIENT))
                    .then_some(AMBIENT)
            }
        };
        if let Some(around) = around {
            contents.add(self.scene, around, meter, unit)?;
        }
        if contents.matter.len() > MAX_LABELS {
            return refuse(format!("it has more than {MAX_LABELS} kinds of matter"));
        }
        let label = |voxel: usize| {
            let medium = match &self.filling {
                Filling::One(medium) => *medium,
                Filling::Voxels(voxels) => voxels.of_voxel(voxel).unwrap_or(AMBIENT),
            };
            let first = contents.first_label(medium).unwrap_or_default();
            let labels = self.scene.medium(medium).labels.as_ref();
            let own = labels.map_or(0, |labels| {
                let own = usize::from(labels.grid().labels()[voxel]);
                own.min(labels.list().len() - 1)
            });
            (first + own) as u8
        };
        contents.labels = (0..meter.grid.cells()).map(label).collect();
        Ok(contents)
    }
}

/// Contents of voxels.
#[derive(Default)]
struct Contents {
    labels: Vec<u8>,
    matter: Vec<DeviceMatter>,
    /// Each medium, with the first of its labels.
    media: Vec<(MediumId, usize)>,
}

impl Contents {
    /// Returns the first label of a medium.
    fn first_label(&self, medium: MediumId) -> Option<usize> {
        let mut media = self.media.iter();
        media.find(|(m, _)| *m == medium).map(|(_, first)| *first)
    }

    /// Returns the media that lie only in the voxels.
    fn inside(&self) -> impl Iterator<Item = MediumId> {
        let media = self.media.iter().map(|(medium, _)| *medium);
        media.filter(|medium| *medium != AMBIENT)
    }

    /// Adds the matter of a medium, unless it is there.
    fn add(
        &mut self,
        scene: &Scene,
        id: MediumId,
        meter: &FluenceMeter,
        unit: f64,
    ) -> Result<(), Unsuitable> {
        if self.first_label(id).is_some() {
            return Ok(());
        }
        self.media.push((id, self.matter.len()));
        let medium = scene.medium(id);
        let n = if medium.index.is_constant() {
            medium.index.n(DVec3::ZERO)
        } else {
            f64::NAN
        };
        let Some(labels) = &medium.labels else {
            let extinction = medium.uniform_extinction();
            let Some(coefficients) = extinction.zip(medium.uniform_absorption()) else {
                return refuse(format!("the coefficients of {} vary", medium.name));
            };
            let coefficients = [coefficients.0[0], coefficients.1[0]];
            let matter = device_matter(n, coefficients, &medium.phase, unit)?;
            self.matter.push(matter);
            return Ok(());
        };
        let grid: &LabelGrid = labels.grid();
        let is_same = grid.size() == meter.grid.size()
            && is_same_place(meter.grid.to_world(), &grid.to_world());
        if !is_same {
            return refuse("the cells of its fluencemeter are not the voxels of its labels");
        }
        for (label, of) in labels.list().iter().enumerate() {
            let Some(phase) = medium.phase.of_label(labels.grid(), label) else {
                return refuse(format!("the phase function of {} varies", medium.name));
            };
            let coefficients = [of.extinction[0], of.absorption[0]];
            self.matter
                .push(device_matter(n, coefficients, phase, unit)?);
        }
        Ok(())
    }

    /// Returns the index of all media, if it varies.
    fn index(
        &self,
        scene: &Scene,
        from_cells: DAffine3,
        unit: f64,
    ) -> Result<Option<DeviceIndex>, Unsuitable> {
        let indices = self.media.iter().map(|(id, _)| &scene.medium(*id).index);
        let indices: Vec<&Field> = indices.collect();
        if indices.iter().all(|index| index.is_constant()) {
            return Ok(None);
        }
        if indices.iter().any(|index| index.is_constant()) {
            return refuse("its index varies in some media, and is constant in others");
        }
        let splines: Option<Vec<_>> = indices.iter().map(|index| index.spline()).collect();
        let Some(mut splines) = splines else {
            return refuse("its index varies, but is not sampled on a grid (bspline)");
        };
        if splines.iter().any(|spline| *spline != splines[0]) {
            return refuse("its index varies differently in its media");
        }
        DeviceIndex::new(splines.swap_remove(0), from_cells, unit).map(Some)
    }
}

fn device_matter(
    n: f64,
    [extinction, absorption]: [f64; 2],
    phase: &Phase,
    unit: f64,
) -> Result<DeviceMatter, Unsuitable> {
    let g = match phase {
        Phase::Isotropic(_) => 0.0,
        Phase::HenyeyGreenstein(phase) => phase.g(),
        _ => return refuse("its phase function is neither isotropic nor Henyey–Greenstein"),
    };
    Ok(DeviceMatter {
        n,
        extinction: extinction * unit,
        albedo: if extinction > 0.0 {
            1.0 - absorption / extinction
        } else {
            1.0
        },
        g,
        absorption,
    })
}

impl DeviceIndex {
    /// Prepares an index for voxels that `from_cells` maps to the world.
    fn new(
        spline: SplineCoefficients,
        from_cells: DAffine3,
        unit: f64,
    ) -> Result<Self, Unsuitable> {
        let extremes = [f32::INFINITY, f32::NEG_INFINITY];
        let [low, high] = spline.values.iter().fold(extremes, |[low, high], value| {
            [low.min(*value), high.max(*value)]
        });
        let contrast = f64::from(high - low) / (2.0 * spline.n2_ref);
        if contrast < MIN_CONTRAST {
            return refuse(format!(
                "its index varies by {contrast:.1e} of itself, which single precision loses below {MIN_CONTRAST:.0e}"
            ));
        }
        let per_spacing = spline.to_index.matrix3.transpose();
        let rows = [per_spacing.x_axis, per_spacing.y_axis, per_spacing.z_axis];
        let spacings = rows.iter().map(|row| 1.0 / row.length());
        Ok(DeviceIndex {
            to_spline: spline.to_index * from_cells,
            step: STEP * spacings.fold(unit, f64::min) / unit,
            spline,
        })
    }

    /// Returns true if the spline covers the box from 0 to `cells`, up to one spacing beyond its
    /// outermost samples.
    fn covers(&self, cells: DVec3) -> bool {
        let last = DVec3::from_array(self.spline.dims.map(|n| n as f64 - 2.0));
        let range = (DVec3::ONE - PLACE_TOLERANCE, last + PLACE_TOLERANCE);
        let corners = Aabb::new(DVec3::ZERO, cells).corners();
        let places = corners.map(|corner| self.to_spline.transform_point3(corner));
        places
            .iter()
            .all(|p| p.cmpge(range.0).all() && p.cmple(range.1).all())
    }
}

/// Returns true if two maps place the unit cube equally, up to rounding.
fn is_same_place(one: &DAffine3, other: &DAffine3) -> bool {
    (one.inverse() * *other).abs_diff_eq(DAffine3::IDENTITY, PLACE_TOLERANCE)
}
