//! Sound of transducers: complex amplitudes of the pressure by the Rayleigh integral
//! (docs/theory.md#transducers).
//!
//! A transducer has its own coordinates. It lies at the origin (a ring lies around it), and a bowl,
//! a disc or a line radiates towards +z. Lengths may be in any unit.

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

/// Least distance of points from a transducer, in wavelengths. Shorter distances need more points
/// for the integral.
pub const MIN_DISTANCE: f64 = 0.5;
/// Largest number of pairs of a grid point and a surface point: half a minute on one CPU core.
const MAX_PAIRS: f64 = 1e10;

/// A transducer that oscillates at one frequency.
#[derive(Clone, Debug, PartialEq)]
pub struct Transducer {
    /// Surface.
    pub aperture: SoundAperture,
    /// Wavelength of the sound, positive.
    pub wavelength: f64,
    /// Pressure ρcv in Pa of a plane wave whose velocity v is the velocity of the surface.
    pub pressure: f64,
}

/// Points of a regular grid, in the coordinates of a transducer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Places {
    /// Number of points along each step.
    pub size: [usize; 3],
    /// Position of the first point.
    pub first: DVec3,
    /// Steps between neighbouring points along the grid's three axes, perpendicular to each other.
    pub steps: [DVec3; 3],
}

impl Places {
    /// Returns the number of points.
    pub fn count(&self) -> usize {
        self.size.iter().product()
    }

    /// Returns the point with index `i`; the first axis runs fastest.
    pub fn at(&self, i: usize) -> DVec3 {
        let [x, y, _] = self.size;
        self.of([i % x, i / x % y, i / x / y].map(|i| i as f64))
    }

    /// Returns the point at this number of steps from the first.
    fn of(&self, steps: [f64; 3]) -> DVec3 {
        let steps = self.steps.iter().zip(steps);
        steps.fold(self.first, |place, (step, many)| place + *step * many)
    }

    /// Returns the distance of `point` from the box that the grid fills. Its edges, the steps, are
    /// perpendicular to each other.
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
    /// Returns real and imaginary part of the complex amplitude P at each point, in Pa. The
    /// pressure is Re(P e^{iωt}). Without delays, the velocity of the surface is v cos ωt.
    ///
    /// # Errors
    ///
    /// Returns an error for
    ///
    /// - sizes that are not positive,
    /// - delays or weights that differ in number from the elements,
    /// - points nearer to the surface than [`MIN_DISTANCE`],
    /// - more work than half a minute of a processor core.
    pub fn amplitudes(&self, places: &Places) -> Result<Vec<[f64; 2]>, TransducerError> {
        let density = self.density(places)?;
        let sources = self.sources(&density)?;
        let nodes = Chebyshev::new(places, &density)?;
        let (count, points) = (nodes.count(), sources.len());
        if count as f64 * points as f64 > MAX_PAIRS {
            return Err(TransducerError::TooMuchWork {
                places: count,
                points,
            });
        }
        let values = sources.amplitudes(count, |i| nodes.at(i));
        Ok(nodes.interpolate(values))
    }

    /// Returns the amplitude at one point, without a grid.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`Transducer::amplitudes`].
    pub fn amplitude(&self, place: DVec3) -> Result<[f64; 2], TransducerError> {
        let density = self.density(&Places {
            size: [1; 3],
            first: place,
            steps: [DVec3::X, DVec3::Y, DVec3::Z],
        })?;
        let sources = self.sources(&density)?;
        Ok(sources.amplitudes(1, |_| place)[0])
    }

    /// Returns the density of points that the sound in a box needs.
    fn density(&self, places: &Places) -> Result<Density, TransducerError> {
        self.aperture.check()?;
        let least = MIN_DISTANCE * self.wavelength;
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
