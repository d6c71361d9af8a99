//! Why the sound of a transducer is not computed.

use eikonal::Shown;

/// What is wrong with a transducer, or with where its sound is wanted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransducerError {
    /// A size that is not positive and finite.
    #[error("{what} must be positive and finite, but is {}", Shown(*value))]
    Size {
        /// Name of the size.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A bowl that is more than half a sphere.
    #[error(
        "the diameter of a bowl is at most twice its radius of curvature, {}, but is {}",
        Shown(2.0 * radius),
        Shown(*diameter)
    )]
    Bowl {
        /// Radius of curvature.
        radius: f64,
        /// Of the aperture.
        diameter: f64,
    },
    /// Elements that overlap.
    #[error("elements of width {} overlap: neighbours are {} apart", Shown(*width), Shown(*apart))]
    Overlap {
        /// Of an element.
        width: f64,
        /// From the middle of an element to that of the next.
        apart: f64,
    },
    /// No elements.
    #[error("an array has at least one element")]
    NoElements,
    /// Delays or weights that do not fit the elements.
    #[error("{found} {what} are given for {elements} elements")]
    Count {
        /// What they are.
        what: &'static str,
        /// Their number.
        found: usize,
        /// Number of elements.
        elements: usize,
    },
    /// A place on the surface or next to it.
    #[error(
        "the box of the sound comes within {} of the transducer: keep half a wavelength away, {}",
        Shown::rounded(*distance),
        Shown::rounded(*least)
    )]
    TooNear {
        /// Of the box from the surface.
        distance: f64,
        /// That must be kept.
        least: f64,
    },
    /// A surface that is too large for its wavelength.
    #[error(
        "the transducer is too large for its wavelength: {0:.1e} points would be needed to integrate over it"
    )]
    TooLarge(f64),
    /// A box that is too long for its wavelength.
    #[error(
        "the box of the sound is too long for its wavelength: it has {samples} samples along an axis"
    )]
    LongBox {
        /// Along the axis.
        samples: usize,
    },
    /// More work than half a minute.
    #[error(
        "too much work: the sound of {points} points of the transducer at {places} places; shrink the box of the sound, or the transducer"
    )]
    TooMuchWork {
        /// Where it is computed.
        places: usize,
        /// Points of the surface.
        points: usize,
    },
}
