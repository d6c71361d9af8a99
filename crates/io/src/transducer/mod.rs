//! The sound of transducers: complex amplitudes of the pressure by the Rayleigh integral (docs/theory.md#transducers).
//!
//! A transducer has coordinates of its own: it sits at the origin (a ring around it) and a bowl, a disc or a line radiates towards +z.
//! Lengths are in any unit.

mod aperture;
mod error;
mod meridian;
mod quadrature;
mod rayleigh;

pub use aperture::{Aperture, Array, ArrayLayout};
pub use error::TransducerError;

use eikonal::Aabb;
use glam::DVec3;
use meridian::Meridian;
use quadrature::Density;
use rayleigh::Sources;

/// How near to a transducer places may be, in wavelengths: the nearer, the more points the integral needs.
pub const NEAREST: f64 = 0.5;
/// The most pairs of a place and a point of the surface: some minutes of one processor core.
const MOST_PAIRS: f64 = 5e10;

/// A transducer that oscillates at one frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Transducer {
    /// Its surface.
    pub aperture: Aperture,
    /// Of the sound, positive.
    pub wavelength: f64,
    /// ρcv in Pa: the pressure of a plane wave whose velocity v is that of the surface.
    pub pressure: f64,
}

/// Places on a regular grid, in a transducer's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Places {
    /// Number of places along each step.
    pub size: [usize; 3],
    /// The first.
    pub first: DVec3,
    /// From each to the next along the three axes of the grid.
    pub steps: [DVec3; 3],
}

impl Places {
    /// Their number.
    pub fn count(&self) -> usize {
        self.size.iter().product()
    }

    /// The place with a number; the first index runs fastest.
    pub fn at(&self, i: usize) -> DVec3 {
        let [x, y, _] = self.size;
        self.of([i % x, i / x % y, i / x / y])
    }

    fn of(&self, index: [usize; 3]) -> DVec3 {
        let steps = self.steps.iter().zip(index);
        steps.fold(self.first, |place, (step, i)| place + *step * i as f64)
    }

    /// The corners of the box that they fill.
    fn corners(&self) -> [DVec3; 8] {
        let last = self.size.map(|n| n.saturating_sub(1));
        std::array::from_fn(|corner| {
            let end = |axis: usize| {
                if corner >> axis & 1 == 1 {
                    last[axis]
                } else {
                    0
                }
            };
            self.of([end(0), end(1), end(2)])
        })
    }
}

impl Transducer {
    /// Real and imaginary part of the complex amplitude P at places, in Pa: the pressure is Re(P e^{iωt}), and the velocity
    /// of the surface v cos ωt, but for delays.
    ///
    /// # Errors
    ///
    /// Sizes that are not positive, delays or weights of another number of elements, places nearer to the surface than
    /// [`NEAREST`], and more work than some minutes.
    pub fn amplitudes(&self, places: &Places) -> Result<Vec<[f64; 2]>, TransducerError> {
        let sources = self.sources(&Aabb::around(places.corners()))?;
        let meridian = self
            .aperture
            .is_round()
            .then(|| Meridian::of(places, self.wavelength));
        let meridian = meridian.filter(|meridian| meridian.count() < places.count());
        let count = meridian.as_ref().map_or(places.count(), Meridian::count);
        if count as f64 * sources.len() as f64 > MOST_PAIRS {
            return Err(TransducerError::TooMuchWork {
                places: count,
                points: sources.len(),
            });
        }
        Ok(match meridian {
            None => sources.amplitudes(count, |i| places.at(i)),
            Some(meridian) => {
                let values = sources.amplitudes(count, |i| meridian.at(i));
                meridian.interpolate(&values, places)
            }
        })
    }

    /// The amplitude at one place, without a grid.
    ///
    /// # Errors
    ///
    /// As for [`Transducer::amplitudes`].
    pub fn amplitude(&self, place: DVec3) -> Result<[f64; 2], TransducerError> {
        let sources = self.sources(&Aabb::new(place, place))?;
        Ok(sources.amplitudes(1, |_| place)[0])
    }

    /// Points of the surface, as dense as a box of places wants them.
    fn sources(&self, places: &Aabb) -> Result<Sources, TransducerError> {
        self.aperture.check()?;
        let dense = Density {
            wavelength: self.wavelength,
            distance: NEAREST * self.wavelength,
        };
        let points = self.aperture.points(&dense)?;
        let distances = points
            .iter()
            .map(|p| p.place.distance(p.place.clamp(places.min, places.max)));
        let distance = distances.fold(f64::INFINITY, f64::min);
        if !(distance >= NEAREST * self.wavelength) {
            return Err(TransducerError::TooNear {
                distance,
                least: NEAREST * self.wavelength,
            });
        }
        let points = self.aperture.points(&Density { distance, ..dense })?;
        Ok(Sources::new(&points, self.wavelength, self.pressure))
    }
}
