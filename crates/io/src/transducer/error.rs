//! Errors in computing the sound of a transducer.

use eikonal::Shown;

/// Error in a transducer, or in the box where its sound is computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransducerError {
    /// A size that is not positive and finite.
    #[error("{what} must be positive and finite, but is {}", Shown(*value))]
    Size {
        /// Name of the size.
        what: &'static str,
        /// Value of the size.
        value: f64,
    },
    /// A bowl that is more than half a sphere.
    #[error(
        "the diameter of a bowl must be at most twice its radius of curvature, {}, but is {}",
        Shown(2.0 * radius),
        Shown(*diameter)
    )]
    Bowl {
        /// Radius of curvature.
        radius: f64,
        /// Diameter of the aperture.
        diameter: f64,
    },
    /// Elements that overlap.
    #[error("elements of width {} overlap: the distance of neighbours is only {}", Shown(*width), Shown(*apart))]
    Overlap {
        /// Width of an element.
        width: f64,
        /// Distance between the centres of neighbouring elements.
        apart: f64,
    },
    /// No elements.
    #[error("an array must have at least one element")]
    NoElements,
    /// Numbers of delays or weights that differ from the number of elements.
    #[error("{found} {what} are given for {elements} elements")]
    Count {
        /// Name of the list: delays or weights.
        what: &'static str,
        /// Length of the list.
        found: usize,
        /// Number of elements.
        elements: usize,
    },
    /// A point on the surface or next to it.
    #[error(
        "the box of the sound is only {} from the transducer: keep it at least half a wavelength, {}, away",
        Shown::rounded(*distance),
        Shown::rounded(*least)
    )]
    TooNear {
        /// Distance of the box from the surface.
        distance: f64,
        /// Least allowed distance.
        least: f64,
    },
    /// A surface that is too large for its wavelength.
    #[error(
        "the transducer is too large for its wavelength: the integral over it needs {0:.1e} points; check their units"
    )]
    TooLarge(f64),
    /// A box that is too long for its wavelength.
    #[error(
        "the box of the sound is too long for its wavelength: it needs {samples} samples along an axis; shrink it"
    )]
    LongBox {
        /// Number of samples along the axis.
        samples: usize,
    },
    /// More work than half a minute on one CPU core.
    #[error(
        "too much work: the sound of {points} points of the transducer at {places} places; shrink the box of the sound, or the transducer"
    )]
    TooMuchWork {
        /// Number of points where the sound is computed.
        places: usize,
        /// Number of points of the surface.
        points: usize,
    },
}
