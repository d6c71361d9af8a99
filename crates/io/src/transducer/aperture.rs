//! Surfaces of transducers, as points with areas (docs/theory.md#transducers).

use super::TransducerError;
use super::quadrature::{Density, gauss_legendre};
use glam::DVec3;
use std::f64::consts::TAU;

/// Largest number of points of a surface.
const MAX_POINTS: f64 = 1e6;

/// A surface that moves along its normals.
#[derive(Clone, Debug, PartialEq)]
pub enum SoundAperture {
    /// Part of a sphere. Its apex is the origin; its centre, the focus, lies on +z.
    Bowl {
        /// Radius of curvature.
        radius: f64,
        /// Diameter of the rim, at most twice the radius.
        diameter: f64,
    },
    /// A flat disc around the origin, a piston in a rigid wall.
    Disc {
        /// Diameter.
        diameter: f64,
    },
    /// Rectangular elements.
    ElementArray(ElementArray),
}

/// Rectangles that oscillate, each with its own amplitude and delay.
#[derive(Clone, Debug, PartialEq)]
pub struct ElementArray {
    /// Positions of the elements.
    pub layout: ArrayLayout,
    /// Number of elements.
    pub elements: usize,
    /// Width of an element: along x, or along the ring.
    pub width: f64,
    /// Height of an element: along y, or along z for a ring.
    pub height: f64,
    /// Phase lags of the elements, in radians; empty if all are 0.
    pub lags: Vec<f64>,
    /// Factors of the elements' amplitudes; empty if all are 1.
    pub weights: Vec<f64>,
}

/// Arrangement of elements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArrayLayout {
    /// Line along x, centred at the origin and facing +z.
    Line {
        /// Distance between the centres of neighbouring elements.
        pitch: f64,
    },
    /// Ring around z, facing the origin. The first element is on +x, the second towards +y.
    Ring {
        /// Distance from the origin to the centre of an element.
        radius: f64,
    },
}

/// A point of a surface.
pub(super) struct SurfacePoint {
    pub place: DVec3,
    /// Area that the point represents.
    pub area: f64,
    /// Factor of the amplitude.
    pub weight: f64,
    /// Phase lag in radians.
    pub lag: f64,
}

/// A rectangular element.
struct Element {
    middle: DVec3,
    /// Unit vector along the first side of the element; `across` is the unit vector along the
    /// second side.
    along: DVec3,
    across: DVec3,
}

impl SoundAperture {
    /// Refuses sizes that are impossible.
    pub(super) fn check(&self) -> Result<(), TransducerError> {
        match *self {
            SoundAperture::Bowl { radius, diameter } => {
                positive("the radius of curvature", radius)?;
                positive("the diameter", diameter)?;
                let fits = diameter <= 2.0 * radius;
                fits.then_some(())
                    .ok_or(TransducerError::Bowl { radius, diameter })
            }
            SoundAperture::Disc { diameter } => positive("the diameter", diameter),
            SoundAperture::ElementArray(ref array) => array.check(),
        }
    }

    /// Returns points of the surface.
    pub(super) fn points(&self, density: &Density) -> Result<Vec<SurfacePoint>, TransducerError> {
        match *self {
            SoundAperture::Bowl { radius, diameter } => {
                let widest = (0.5 * diameter / radius).min(1.0).asin();
                rings(density, radius * widest, 0.5 * diameter, |arc| {
                    let (sin, cos) = (arc / radius).sin_cos();
                    // Compute 1 − cos without cancellation.
                    [radius * sin, radius * sin * sin / (1.0 + cos)]
                })
            }
            SoundAperture::Disc { diameter } => {
                let radius = 0.5 * diameter;
                rings(density, radius, radius, |arc| [arc, 0.0])
            }
            SoundAperture::ElementArray(ref array) => array.points(density),
        }
    }
}

/// Returns points on rings around z. `ring` returns a ring's radius and height as functions of the
/// arc from the axis. `arc` is the largest arc, `widest` the largest radius.
fn rings(
    density: &Density,
    arc: f64,
    widest: f64,
    ring: impl Fn(f64) -> [f64; 2],
) -> Result<Vec<SurfacePoint>, TransducerError> {
    let steps = density.along(arc);
    bounded(steps * density.around(widest))?;
    let mut points = Vec::new();
    for [arc, width] in gauss_legendre(steps as usize, arc) {
        let [radius, height] = ring(arc);
        let around = density.around(radius);
        let area = TAU * radius * width / around;
        points.extend((0..around as usize).map(|i| {
            let (sin, cos) = (TAU * i as f64 / around).sin_cos();
            SurfacePoint {
                place: DVec3::new(radius * cos, radius * sin, height),
                area,
                weight: 1.0,
                lag: 0.0,
            }
        }));
    }
    Ok(points)
}

impl ElementArray {
    /// Sets the lags so that the sound of all elements arrives at `focus` in phase. The farthest
    /// element has lag 0.
    ///
    /// # Errors
    ///
    /// Returns the errors of [`Transducer::amplitudes`](super::Transducer::amplitudes).
    pub fn focused(self, focus: DVec3, wavelength: f64) -> Result<Self, TransducerError> {
        self.check()?;
        let distances: Vec<f64> = (0..self.elements)
            .map(|i| self.element(i).middle.distance(focus))
            .collect();
        let farthest = distances.iter().copied().fold(0.0, f64::max);
        let lags = distances.iter().map(|d| TAU * (farthest - d) / wavelength);
        Ok(ElementArray {
            lags: lags.collect(),
            ..self
        })
    }

    fn check(&self) -> Result<(), TransducerError> {
        let elements = self.elements;
        if elements == 0 {
            return Err(TransducerError::NoElements);
        }
        positive("the width of an element", self.width)?;
        positive("the height of an element", self.height)?;
        for (what, found) in [("delays", self.lags.len()), ("weights", self.weights.len())] {
            if found != 0 && found != elements {
                return Err(TransducerError::Count {
                    what,
                    found,
                    elements,
                });
            }
        }
        let apart = match self.layout {
            ArrayLayout::Line { pitch } => {
                positive("the pitch", pitch)?;
                pitch
            }
            ArrayLayout::Ring { radius } => {
                positive("the radius of the ring", radius)?;
                // Neighbouring flat elements touch at their edges.
                2.0 * radius * (0.5 * TAU / elements as f64).min(0.24 * TAU).tan()
            }
        };
        let fits = elements == 1 || self.width <= apart * (1.0 + 1e-9);
        fits.then_some(()).ok_or(TransducerError::Overlap {
            width: self.width,
            apart,
        })
    }

    fn element(&self, i: usize) -> Element {
        match self.layout {
            ArrayLayout::Line { pitch } => Element {
                middle: DVec3::X * (i as f64 - 0.5 * (self.elements - 1) as f64) * pitch,
                along: DVec3::X,
                across: DVec3::Y,
            },
            ArrayLayout::Ring { radius } => {
                let (sin, cos) = (TAU * i as f64 / self.elements as f64).sin_cos();
                Element {
                    middle: DVec3::new(cos, sin, 0.0) * radius,
                    along: DVec3::new(-sin, cos, 0.0),
                    across: DVec3::Z,
                }
            }
        }
    }

    fn points(&self, density: &Density) -> Result<Vec<SurfacePoint>, TransducerError> {
        let [across, along] = [self.height, self.width].map(|side| density.along(side));
        bounded(across * along * self.elements as f64)?;
        let rule = |n: f64, side: f64| -> Vec<[f64; 2]> {
            gauss_legendre(n as usize, side)
                .map(|[x, w]| [x - 0.5 * side, w])
                .collect()
        };
        let (across, along) = (rule(across, self.height), rule(along, self.width));
        let mut points = Vec::with_capacity(across.len() * along.len() * self.elements);
        for i in 0..self.elements {
            let element = self.element(i);
            let weight = self.weights.get(i).copied().unwrap_or(1.0);
            let lag = self.lags.get(i).copied().unwrap_or(0.0);
            for [y, height] in &across {
                points.extend(along.iter().map(|[x, width]| SurfacePoint {
                    place: element.middle + element.along * *x + element.across * *y,
                    area: width * height,
                    weight,
                    lag,
                }));
            }
        }
        Ok(points)
    }
}

fn positive(what: &'static str, value: f64) -> Result<(), TransducerError> {
    let is_positive = value > 0.0 && value.is_finite();
    is_positive
        .then_some(())
        .ok_or(TransducerError::Size { what, value })
}

/// Refuses more than [`MAX_POINTS`] points.
fn bounded(points: f64) -> Result<(), TransducerError> {
    (points <= MAX_POINTS)
        .then_some(())
        .ok_or(TransducerError::TooLarge(points))
}
