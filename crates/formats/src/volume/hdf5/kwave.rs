//! Metadata of arrays in k-Wave files: the recorded points of the simulation's grid, their order
//! and their positions. See k-Wave user manual 1.1, appendix B. The axes of MATLAB arrays are
//! reversed here.

use glam::DVec3;
use hdf5_reader::Hdf5File;

use super::elements::{number, numbers};
use super::{blocks, describe};
use crate::error::Problem;
use crate::volume::AxisOrder;
use crate::volume::layout::Layout;

/// Maximum number of cuboids of a sensor.
const MAX_CUBOIDS: u64 = 10_000;
/// Advice for points that do not form a box.
const RECORD_A_BOX: &str = "let the sensor record a cuboid (two corners), or the whole grid";

/// Grid of a simulation.
struct Simulation {
    /// Numbers of points along x, y, z.
    size: [usize; 3],
}

/// Box of points of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PointBox {
    first: [usize; 3],
    size: [usize; 3],
}

/// Array that a sensor recorded.
pub(super) struct Recorded {
    points: PointBox,
    pub layout: Layout,
}

/// Returns the distances of points, in metres.
pub(super) fn spacing(file: &Hdf5File) -> Option<DVec3> {
    let number = |name| number(file, name).filter(|v| *v > 0.0);
    Some(DVec3::new(number("dx")?, number("dy")?, number("dz")?))
}

/// Returns the time step, in seconds.
pub(super) fn time_step(file: &Hdf5File) -> Option<f64> {
    number(file, "dt").filter(|v| *v > 0.0)
}

/// Returns the layout of a dataset of a simulation's output, if a sensor recorded it: `[1, t,
/// point]` at the points of a mask, or `[t, z, y, x]` in a cuboid, `/p/1` being the first.
pub(super) fn recorded(
    file: &Hdf5File,
    name: &str,
    shape: &[usize],
) -> Result<Option<Recorded>, Problem> {
    let Some(simulation) = Simulation::of(file) else {
        return Ok(None);
    };
    match *shape {
        [1, y, x] if [x, y, 1] == simulation.size => Ok(None),
        [1, frames, points] => {
            let points = simulation.mask(file, points)?;
            let layout = Layout::columns(points.size, frames)?;
            Ok(Some(Recorded { points, layout }))
        }
        [_, z, y, x] => {
            let last = name.rsplit_once('/').map(|(_, last)| last.parse());
            let Some(Ok(number)) = last else {
                return Ok(None);
            };
            let points = simulation.cuboid(file, number)?;
            if points.size != [x, y, z] {
                let [a, b, c] = points.size;
                return Err(Problem::Mismatch {
                    expected: format!("{a} x {b} x {c} points in cuboid {number} of the sensor"),
                    found: format!("{x} x {y} x {z}"),
                });
            }
            let layout = Layout::new(shape, false, AxisOrder::CZYX)?;
            Ok(Some(Recorded { points, layout }))
        }
        _ => Ok(None),
    }
}

impl Recorded {
    /// Returns the index of the first point.
    pub(super) fn first(&self) -> DVec3 {
        DVec3::from_array(self.points.first.map(|n| n as f64))
    }
}

impl Simulation {
    fn of(file: &Hdf5File) -> Option<Self> {
        let points = |name| {
            let n = number(file, name)?;
            (n >= 1.0 && n < f64::from(u32::MAX) && n.fract() == 0.0).then_some(n as usize)
        };
        let size = [points("Nx")?, points("Ny")?, points("Nz").unwrap_or(1)];
        Some(Simulation { size })
    }

    /// Returns the box of all points.
    fn whole(&self) -> PointBox {
        PointBox {
            first: [0; 3],
            size: self.size,
        }
    }

    /// Returns the box of the points of a mask, whose order is the order of the columns.
    fn mask(&self, file: &Hdf5File, points: usize) -> Result<PointBox, Problem> {
        let [x, y, z] = self.size;
        let Ok(mask) = file.dataset("sensor_mask_index") else {
            let whole = self.whole();
            return match whole.count() {
                Some(count) if count == points => Ok(whole),
                _ => Err(Problem::Mismatch {
                    expected: format!(
                        "pressure at all {x} x {y} x {z} points of k-Wave's grid, or 'sensor_mask_index', which says where \
                         it is (--copy_sensor_mask of k-Wave)"
                    ),
                    found: format!("{points} points of a mask"),
                }),
            };
        };
        if mask.num_elements().map_err(describe)? != points as u64 {
            return Err(Problem::Mismatch {
                expected: format!("{points} points in 'sensor_mask_index'"),
                found: format!("{:?}", mask.shape()),
            });
        }
        let mut found = Bounds::default();
        let column = Layout::columns([points, 1, 1], 1)?;
        blocks::each(&mask, &column, 0..1, |_, index| {
            found.add(self.place(index), index)
        })?;
        found.as_box(points).ok_or_else(|| {
            Problem::Unsupported(format!(
                "{points} points of a mask that are not all points of a box, in their order: {RECORD_A_BOX}"
            ))
        })
    }

    /// Returns the point of an index of a mask, which counts from 1.
    fn place(&self, index: f64) -> Option<[usize; 3]> {
        let [x, y, z] = self.size;
        let i = (index >= 1.0 && index.fract() == 0.0).then(|| index as usize - 1)?;
        let place = [i % x, i / x % y, i / x / y];
        (place[2] < z).then_some(place)
    }

    /// Returns a cuboid of the sensor; the first has the number 1.
    fn cuboid(&self, file: &Hdf5File, number: usize) -> Result<PointBox, Problem> {
        let corners = file.dataset("sensor_mask_corners").map_err(|_| {
            let message = "it does not say where its cuboids are: 'sensor_mask_corners' is missing (--copy_sensor_mask of k-Wave)";
            Problem::Unsaid(message.into())
        })?;
        let cuboids = corners.num_elements().map_err(describe)? / 6;
        if cuboids > MAX_CUBOIDS {
            return Err(Problem::TooLarge(format!("a sensor of {cuboids} cuboids")));
        }
        let all = numbers(file, "sensor_mask_corners", 6 * cuboids as usize);
        let all = all.unwrap_or_default();
        let cuboid = number
            .checked_sub(1)
            .and_then(|i| all.chunks_exact(6).nth(i));
        let point_box = cuboid.and_then(|corners| self.between(corners));
        point_box.ok_or_else(|| {
            Problem::Malformed(format!(
                "'sensor_mask_corners' has no cuboid {number} that is in the grid"
            ))
        })
    }

    /// Returns the box between two corners, inclusive, which count from 1.
    fn between(&self, corners: &[f64]) -> Option<PointBox> {
        let mut point_box = self.whole();
        for axis in 0..3 {
            let (low, high) = (corners[axis], corners[axis + 3]);
            if !(low >= 1.0 && high >= low && high <= self.size[axis] as f64) {
                return None;
            }
            point_box.first[axis] = low as usize - 1;
            point_box.size[axis] = high as usize + 1 - low as usize;
        }
        Some(point_box)
    }
}

impl PointBox {
    fn count(&self) -> Option<usize> {
        let [x, y, z] = self.size;
        x.checked_mul(y)?.checked_mul(z)
    }
}

/// Lower and upper corner of points.
#[derive(Default)]
struct Bounds {
    corners: Option<[[usize; 3]; 2]>,
    last: f64,
    /// True if a point is outside the grid, or its index does not exceed the previous index.
    bad: bool,
}

impl Bounds {
    fn add(&mut self, place: Option<[usize; 3]>, index: f64) {
        self.bad |= place.is_none() || index <= self.last;
        self.last = index;
        let Some(place) = place else {
            return;
        };
        let [low, high] = self.corners.get_or_insert([place; 2]);
        for axis in 0..3 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }

    /// Returns the box of `points` points, if they fill it. The points are distinct, because their
    /// indices increase.
    fn as_box(&self, points: usize) -> Option<PointBox> {
        let [low, high] = self.corners.filter(|_| !self.bad)?;
        let point_box = PointBox {
            first: low,
            size: [0, 1, 2].map(|axis| high[axis] - low[axis] + 1),
        };
        (point_box.count() == Some(points)).then_some(point_box)
    }
}
