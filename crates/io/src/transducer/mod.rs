//! The sound of transducers: complex amplitudes of the pressure by the Rayleigh integral (docs/theory.md#transducers).
//!
//! A transducer has coordinates of its own: it sits at the origin (a ring around it) and a bowl, a disc or a line radiates towards +z.
//! Lengths are in any unit.

mod aperture;
mod chebyshev;
mod error;
mod quadrature;
mod rayleigh;

pub use aperture::{ArrayLayout, ElementArray, SoundAperture};
pub use error::TransducerError;

use chebyshev::Chebyshev;
use glam::{DMat3, DVec3};
use quadrature::Density;
use rayleigh::Sources;

/// How near to a transducer places may be, in wavelengths: the nearer, the more points the integral needs.
pub const NEAREST: f64 = 0.5;
/// The most pairs of a place and a point of the surface: half a minute of one processor core.
const MOST_PAIRS: f64 = 1e10;

/// A transducer that oscillates at one frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Transducer {
    /// Its surface.
    pub aperture: SoundAperture,
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
    /// From each to the next along the three axes of the grid, perpendicular to each other.
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
        self.of([i % x, i / x % y, i / x / y].map(|i| i as f64))
    }

    /// The place that is so many steps from the first.
    fn of(&self, steps: [f64; 3]) -> DVec3 {
        let steps = self.steps.iter().zip(steps);
        steps.fold(self.first, |place, (step, many)| place + *step * many)
    }

    /// The distance of a point from the box that they fill, whose edges, the steps, are perpendicular to each other.
    fn distance(&self, point: DVec3) -> f64 {
        let [x, y, z] = self.steps;
        let edges = DMat3::from_cols(x, y, z);
        let last = self.size.map(|n| n.saturating_sub(1) as f64);
        let steps = edges.inverse() * (point - self.first);
        let nearest = steps.clamp(DVec3::ZERO, DVec3::from_array(last));
        point.distance(self.of(nearest.to_array()))
    }
}

impl Transducer {
    /// Real and imaginary part of the complex amplitude P at places, in Pa: the pressure is Re(P e^{iωt}), and the velocity
    /// of the surface v cos ωt, but for delays.
    ///
    /// # Errors
    ///
    /// Sizes that are not positive, delays or weights of another number of elements, places nearer to the surface than
    /// [`NEAREST`], and more work than half a minute of a processor core.
    pub fn amplitudes(&self, places: &Places) -> Result<Vec<[f64; 2]>, TransducerError> {
        let density = self.density(places)?;
        let sources = self.sources(&density)?;
        let nodes = Chebyshev::new(places, &density)?;
        let (count, points) = (nodes.count(), sources.len());
        if count as f64 * points as f64 > MOST_PAIRS {
            return Err(TransducerError::TooMuchWork {
                places: count,
                points,
            });
        }
        let values = sources.amplitudes(count, |i| nodes.at(i));
        Ok(nodes.interpolate(values))
    }

    /// The amplitude at one place, without a grid.
    ///
    /// # Errors
    ///
    /// As for [`Transducer::amplitudes`].
    pub fn amplitude(&self, place: DVec3) -> Result<[f64; 2], TransducerError> {
        let density = self.density(&Places {
            size: [1; 3],
            first: place,
            steps: [DVec3::X, DVec3::Y, DVec3::Z],
        })?;
        let sources = self.sources(&density)?;
        Ok(sources.amplitudes(1, |_| place)[0])
    }

    /// How fast the sound varies in a box of places.
    fn density(&self, places: &Places) -> Result<Density, TransducerError> {
        self.aperture.check()?;
        let least = NEAREST * self.wavelength;
        let dense = Density {
            wavelength: self.wavelength,
            distance: least,
        };
        let points = self.aperture.points(&dense)?;
        let distances = points.iter().map(|point| places.distance(point.place));
        let distance = distances.fold(f64::INFINITY, f64::min);
        if distance >= least {
            Ok(Density { distance, ..dense })
        } else {
            Err(TransducerError::TooNear { distance, least })
        }
    }

    fn sources(&self, density: &Density) -> Result<Sources, TransducerError> {
        let points = self.aperture.points(density)?;
        Ok(Sources::new(&points, self.wavelength, self.pressure))
    }
}
