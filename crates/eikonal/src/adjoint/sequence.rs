//! Media between surfaces that rays meet in a fixed order, as in a lens
//! (docs/theory.md#derivatives-of-rays).

use super::follow::{RayFailure, Segment};
use super::quadric::Quadric;
use crate::connect::{Crossing, World};
use crate::field::Field;
use crate::interface::Rule;
use crate::ray::Arc;

/// Distance from a surface at which rays start, in units of the largest extent of all surfaces.
const RAY_EPSILON: f64 = 1e-12;

/// An element of a [`Sequence`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SequenceElement {
    /// A surface between two media, at which rays refract.
    Refracting(Quadric),
    /// Opening in an otherwise opaque plane within one medium: a disc around the plane's point,
    /// with this radius.
    Aperture(Quadric, f64),
}

impl SequenceElement {
    /// Returns the surface of the element.
    pub fn surface(&self) -> &Quadric {
        match self {
            SequenceElement::Refracting(surface) | SequenceElement::Aperture(surface, _) => surface,
        }
    }
}

/// Elements in the order in which rays meet them, and the media before, between and behind the
/// refracting elements. A region is the number of elements that a ray has passed.
#[derive(Clone, Debug)]
pub struct Sequence<'a> {
    elements: &'a [SequenceElement],
    media: &'a [Field],
    /// Index of the medium of each region.
    numbers: Vec<usize>,
    ray_epsilon: f64,
}

impl<'a> Sequence<'a> {
    /// Creates a sequence; `None` unless there is one medium more than there are refracting
    /// elements.
    pub fn new(elements: &'a [SequenceElement], media: &'a [Field]) -> Option<Self> {
        let mut numbers = vec![0];
        for element in elements {
            let refracts = matches!(element, SequenceElement::Refracting(_));
            numbers.push(numbers.last()? + usize::from(refracts));
        }
        let extent = elements.iter().map(|e| e.surface().extent());
        let matched = numbers.last()? + 1 == media.len();
        matched.then_some(Sequence {
            elements,
            media,
            numbers,
            ray_epsilon: RAY_EPSILON * extent.fold(f64::MIN_POSITIVE, f64::max),
        })
    }

    /// Returns the index of the medium of a region.
    pub fn medium(&self, region: usize) -> usize {
        self.numbers[region]
    }

    /// Returns all elements; crossings identify them by index.
    pub fn elements(&self) -> &[SequenceElement] {
        self.elements
    }

    /// Returns all media.
    pub fn media(&self) -> &[Field] {
        self.media
    }

    /// Returns the reason why a ray with these segments has no end or did not pass all elements.
    pub(super) fn verdict(
        &self,
        segments: &[Segment<usize>],
        has_end: bool,
    ) -> Result<(), RayFailure> {
        for passed in segments.iter().filter_map(|segment| segment.passed) {
            match self.elements[passed.surface] {
                SequenceElement::Refracting(_) if passed.rule == Rule::Reflect => {
                    return Err(RayFailure::Reflected);
                }
                SequenceElement::Aperture(surface, radius)
                    if surface.distance_from_axis(passed.x) > radius =>
                {
                    return Err(RayFailure::Stopped);
                }
                _ => {}
            }
        }
        let last = segments.last().map_or(0, |segment| segment.region);
        // Planted error "rays that miss a surface taken for rays that come through", found by morgana-eikonal/eikonal::adjoint::failures::rays_that_do_not_come_through:
        // if has_end && last > self.elements.len() {
        if has_end && last < self.elements.len() {
            return Err(RayFailure::MissedSurface);
        }
        Ok(())
    }
}

impl World for Sequence<'_> {
    type Region = usize;

    fn field(&self, region: usize) -> &Field {
        &self.media[self.numbers[region]]
    }

    fn crossing(&self, region: usize, arc: &Arc) -> Option<Crossing<usize>> {
        let element = self.elements.get(region)?;
        let surface = element.surface();
        let theta = surface.first(arc)?;
        let position = arc.position(theta);
        let (normal, shape) = surface.normal(position);
        Some(Crossing {
            theta,
            position,
            normal,
            shape,
            rule: match element {
                SequenceElement::Refracting(_) => Rule::Refract,
                SequenceElement::Aperture(..) => Rule::Pass,
            },
            beyond: region + 1,
            surface: region,
        })
    }

    fn ray_epsilon(&self) -> f64 {
        self.ray_epsilon
    }
}
