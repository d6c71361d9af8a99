//! Arrangements of media and surfaces, and sums of derivatives with respect to them
//! (docs/theory.md#derivatives-of-rays).

use super::embedded::Embedded;
use super::follow::{AdjointRay, RayEnd, RayFailure, RayStart};
use super::forward::WorldChange;
use super::quadric::{DEPARTURES, QuadricDerivative};
use super::receiver::Receiver;
use super::reverse::{IndexSink, SurfaceDerivative};
use super::sequence::Sequence;
use crate::connect::{Crossing, World};
use crate::field::{Field, IndexChange, IndexDerivative};
use crate::interface::Displacement;
use crate::ray::Arc;
use glam::DVec3;

/// Regions that rays pass, identified by numbers.
#[derive(Clone, Debug)]
pub enum Layout<'a> {
    /// A field in a box, region 1, and its surroundings, region 0.
    Boxed(Box<Embedded<'a>>),
    /// Media between surfaces. The region is the number of elements that a ray has passed.
    Sequence(Sequence<'a>),
}

impl Layout<'_> {
    /// Returns the index of the medium of a region; `None` for surroundings.
    fn medium(&self, region: usize) -> Option<usize> {
        match self {
            Layout::Boxed(_) => region.checked_sub(1),
            Layout::Sequence(sequence) => Some(sequence.medium(region)),
        }
    }

    /// Returns the fields with respect to which derivatives are computed.
    pub fn media(&self) -> &[Field] {
        match self {
            Layout::Boxed(embedded) => std::slice::from_ref(embedded.inside()),
            Layout::Sequence(sequence) => sequence.media(),
        }
    }

    /// Returns the number of surfaces with respect to which derivatives are computed.
    pub fn surface_count(&self) -> usize {
        match self {
            Layout::Boxed(_) => 0,
            Layout::Sequence(sequence) => sequence.elements().len(),
        }
    }
}

impl World for Layout<'_> {
    type Region = usize;

    fn field(&self, region: usize) -> &Field {
        match self {
            Layout::Boxed(embedded) => embedded.field(region != 0),
            Layout::Sequence(sequence) => sequence.field(region),
        }
    }

    fn crossing(&self, region: usize, arc: &Arc) -> Option<Crossing<usize>> {
        match self {
            Layout::Boxed(embedded) => {
                let met = embedded.crossing(region != 0, arc)?;
                Some(Crossing {
                    theta: met.theta,
                    position: met.position,
                    normal: met.normal,
                    shape: met.shape,
                    rule: met.rule,
                    beyond: usize::from(met.beyond),
                    surface: met.surface,
                })
            }
            Layout::Sequence(sequence) => sequence.crossing(region, arc),
        }
    }

    fn ray_epsilon(&self) -> f64 {
        match self {
            Layout::Boxed(embedded) => embedded.ray_epsilon(),
            Layout::Sequence(sequence) => sequence.ray_epsilon(),
        }
    }
}

impl AdjointRay<'_, Layout<'_>> {
    /// Traces a ray like [`AdjointRay::follow`], and requires that it passes all elements of a
    /// sequence.
    ///
    /// # Errors
    ///
    /// The reason why the ray has no end, or has not passed all elements.
    pub fn follow_through(&mut self, start: RayStart<usize>) -> Result<RayEnd, RayFailure> {
        let end = self.follow(start);
        let Layout::Sequence(sequence) = self.world else {
            return end;
        };
        let through = sequence.verdict(&self.segments, self.end.is_some());
        let end = through.and(end);
        if end.is_err() {
            self.end = None;
        }
        end
    }
}

/// Sums of derivatives with respect to all parts of a layout and a receiver.
#[derive(Clone, Debug)]
pub struct LayoutDerivative<'a> {
    layout: &'a Layout<'a>,
    receiver: Receiver,
    /// Sums for each medium; [`Field::parameter_derivative`] converts them to derivatives with
    /// respect to its parameters.
    pub media: Vec<Vec<f64>>,
    /// Sums for the point, the axis and the form of the surface of each element in a sequence.
    pub surfaces: Vec<QuadricDerivative>,
    /// Sums for the point and the unit normal of the plane that receives the rays.
    pub exit: [f64; 6],
}

impl<'a> LayoutDerivative<'a> {
    /// Creates sums of zero.
    pub fn new(layout: &'a Layout<'a>, receiver: Receiver) -> Self {
        let media = layout.media().iter();
        LayoutDerivative {
            layout,
            receiver,
            media: media.map(|field| vec![0.0; field.sum_count()]).collect(),
            surfaces: vec![[0.0; 10 + DEPARTURES]; layout.surface_count()],
            exit: [0.0; 6],
        }
    }

    /// Adds the sums of `other`.
    pub fn merge(&mut self, other: &LayoutDerivative) {
        let media = self.media.iter_mut().flatten();
        let rest = self.surfaces.iter_mut().flatten().chain(&mut self.exit);
        let others = other.media.iter().flatten();
        let others = others.chain(other.surfaces.iter().flatten().chain(&other.exit));
        media.chain(rest).zip(others).for_each(|(a, b)| *a += b);
    }
}

impl IndexSink<usize> for LayoutDerivative<'_> {
    fn add(&mut self, region: usize, x: DVec3, by: IndexDerivative) {
        if let Some(medium) = self.layout.medium(region) {
            self.layout.media()[medium].add_parameter_derivative(x, by, &mut self.media[medium]);
        }
    }

    fn add_surface(&mut self, surface: usize, x: DVec3, by: SurfaceDerivative) {
        if let Layout::Sequence(sequence) = self.layout {
            let quadric = sequence.elements()[surface].surface();
            quadric.add_derivative(x, by, &mut self.surfaces[surface]);
        }
    }

    fn add_receiver(&mut self, x: DVec3, by_offset: f64) {
        if let Receiver::Plane { point, normal } = self.receiver {
            let by = [normal * by_offset, (point - x) * by_offset];
            let by = by.map(|v| v.to_array()).concat();
            self.exit
                .iter_mut()
                .zip(by)
                .for_each(|(sum, by)| *sum += by);
        }
    }
}

/// A change of all parts of a layout and a receiver.
#[derive(Clone, Debug)]
pub struct LayoutChange<'a> {
    layout: &'a Layout<'a>,
    receiver: Receiver,
    /// Change of each medium, as [`Field::parameter_change`] returns it.
    pub media: Vec<Vec<f64>>,
    /// Change of the point, the axis and the form of the surface of each element in a sequence.
    pub surfaces: Vec<QuadricDerivative>,
    /// Change of the point and the unit normal of the plane that receives the rays.
    pub exit: [f64; 6],
}

impl<'a> LayoutChange<'a> {
    /// Creates a change of zero.
    pub fn new(layout: &'a Layout<'a>, receiver: Receiver) -> Self {
        let zero = LayoutDerivative::new(layout, receiver);
        LayoutChange {
            layout,
            receiver,
            media: zero.media,
            surfaces: zero.surfaces,
            exit: zero.exit,
        }
    }
}

impl WorldChange<usize> for LayoutChange<'_> {
    fn index(&self, region: usize, x: DVec3) -> IndexChange {
        let medium = self.layout.medium(region);
        medium.map_or(IndexChange::default(), |medium| {
            self.layout.media()[medium].index_change(x, &self.media[medium])
        })
    }

    fn surface(&self, surface: usize, x: DVec3) -> Displacement {
        match self.layout {
            Layout::Boxed(_) => Displacement::default(),
            Layout::Sequence(sequence) => {
                let quadric = sequence.elements()[surface].surface();
                quadric.displacement(x, &self.surfaces[surface])
            }
        }
    }

    fn receiver(&self, x: DVec3) -> f64 {
        match self.receiver {
            Receiver::Plane { point, normal } => {
                let [of_point, of_normal] =
                    [&self.exit[..3], &self.exit[3..]].map(DVec3::from_slice);
                normal.dot(of_point) - of_normal.dot(x - point)
            }
            Receiver::Leaving(_) => 0.0,
        }
    }
}
