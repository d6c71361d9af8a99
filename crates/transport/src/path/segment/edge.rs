//! An edge that was sampled from one end (docs/theory.md#edges-and-geometry-terms).

use super::edge_geometry::EdgeGeometry;
use crate::Spectrum;
use crate::medium::{Attenuation, MediumLabel};
use crate::scene::{MediumId, Scene};
use crate::shape::{Hit, Meeting};
use eikonal::ray::Arc;
use glam::DVec3;

/// The family of rays that an edge is one of: its tangents are taken within the family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Front {
    /// All directions from one point.
    Point,
    /// One direction from all points of a plane across it.
    Plane,
}

/// Where an edge starts.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Position.
    pub x: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Medium.
    pub medium: MediumId,
    /// Family of rays.
    pub(crate) front: Front,
    /// The object on whose surface it lies, if a straight line does not meet that again.
    pub left: Option<usize>,
}

impl Start {
    /// From a point, in one of all directions.
    pub fn point(x: DVec3, direction: DVec3, medium: MediumId) -> Self {
        Start {
            x,
            direction,
            medium,
            front: Front::Point,
            left: None,
        }
    }
}

/// What a subpath carries along its edges. They differ at declared index matches, and at surfaces with a shading normal of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// Basic radiance, towards its sources.
    Radiance,
    /// Importance, away from its source.
    Importance,
}

/// One arc of an edge, within one medium.
#[derive(Clone, Debug)]
pub struct Span<'a> {
    /// The curve, of which only θ ≤ `theta_end` belongs to the edge.
    pub arc: Arc,
    /// See `arc`.
    pub theta_end: f64,
    /// The medium.
    pub medium: MediumId,
    /// Extinction along it.
    pub(crate) attenuation: Attenuation<'a>,
    /// Arc length of the span.
    pub length: f64,
    /// Arc length of the edge before this span.
    pub length_before: f64,
    /// Optical depth of the edge before this span.
    pub depth_before: Spectrum,
    /// Factor of the specular events before this span.
    pub weight_before: Spectrum,
    /// Number of specular events before this span.
    pub events_before: u32,
    /// The object on whose surface it ends, and where, if that is why it ends.
    pub surface: Option<(usize, Meeting)>,
}

/// A point inside a span.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// Parameter of the span's arc.
    pub theta: f64,
    /// Position.
    pub x: DVec3,
    /// Unit direction of the ray.
    pub direction: DVec3,
    /// Medium.
    pub medium: MediumId,
    /// Arc length from the start of the edge.
    pub length: f64,
    /// Optical depth from the start of the edge.
    pub depth: Spectrum,
    /// Extinction that is consistent with the depth.
    pub rate: Spectrum,
    /// The label there, if it is known without a look at voxels.
    pub(crate) label: Option<&'a MediumLabel>,
    /// Factor of the specular events before it.
    pub weight: Spectrum,
}

impl<'a> Span<'a> {
    /// The point at θ.
    pub fn at(&self, theta: f64) -> Point<'a> {
        self.point(theta, self.length_at(theta))
    }

    /// The point at θ, given the arc length from the start of the span.
    fn point(&self, theta: f64, arc_length: f64) -> Point<'a> {
        Point {
            theta,
            x: self.arc.position(theta),
            direction: self.arc.velocity(theta).normalize(),
            medium: self.medium,
            length: self.length_before + arc_length,
            depth: self.depth_before + self.attenuation.depth(theta, arc_length),
            rate: self.attenuation.rate(&self.arc, theta),
            label: self.attenuation.label(),
            weight: self.weight_before,
        }
    }

    /// Arc length of the edge up to the end of this span.
    pub fn length_after(&self) -> f64 {
        self.length_before + self.length
    }

    /// Arc length from the start of the span to θ.
    pub(crate) fn length_at(&self, theta: f64) -> f64 {
        self.arc.arc_length(theta)
    }

    /// θ at which the arc length from the start of the span is `s`, at most the span's own.
    pub fn theta_at_length(&self, s: f64) -> f64 {
        self.arc.theta_at_length(s).min(self.theta_end)
    }

    /// Where the span comes closest to a point.
    pub fn closest_approach(&self, point: DVec3) -> f64 {
        self.arc.closest_approach(point).min(self.theta_end)
    }
}

impl Point<'_> {
    /// Albedo of its medium there.
    #[inline]
    pub(crate) fn albedo(&self, scene: &Scene) -> Spectrum {
        let medium = || scene.medium(self.medium).albedo.at(self.x);
        self.label.map_or_else(medium, MediumLabel::albedo)
    }
}

/// How an edge ended.
#[derive(Clone, Copy, Debug)]
pub enum End<'a> {
    /// At a collision inside a medium.
    Collision(Point<'a>),
    /// On a surface that scatters.
    Surface {
        /// The object.
        object: usize,
        /// Where.
        hit: Hit,
        /// Unit direction of arrival.
        direction: DVec3,
        /// The medium it came through.
        medium: MediumId,
    },
    /// It left the scene.
    Escaped {
        /// Unit direction.
        direction: DVec3,
        /// The medium through which it left.
        medium: MediumId,
    },
    /// It was absorbed by a specular surface, or lost.
    Dead,
}

/// A branch that an edge left aside: by reflection, where it was refracted.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// Where it starts.
    pub start: Start,
    /// What it carries from there, per what the edge carried at its start.
    pub throughput: Spectrum,
    /// Optical path length up to there.
    pub optical_length: f64,
    /// Probability with which an edge that is not split would have gone there.
    pub probability: f64,
}

/// An edge sampled from its start.
#[derive(Clone, Debug)]
pub struct Edge<'a> {
    /// Where it starts.
    pub start: Start,
    /// The arcs up to the end, or beyond a collision up to the first surface that is not
    /// index-matched if the edge was extended; none unless they were to be kept.
    pub spans: Vec<Span<'a>>,
    /// Number of spans before the first specular event, or partial transmission. If the edge was extended they depend on the
    /// start alone, not on where a collision was drawn.
    pub lead: usize,
    /// How it ended.
    pub end: End<'a>,
    /// Arc length up to the end.
    pub length: f64,
    /// Factor of the specular events: reflectances, and n² across declared index matches.
    pub weight: Spectrum,
    /// What connections must know of it.
    pub geometry: EdgeGeometry,
    /// Optical path length up to the end; of an edge that escapes, up to where light that comes this way
    /// is taken to start (see [`super::lead_in`]).
    pub optical_length: f64,
    /// Whether connections look for such edges: see [`crate::path`].
    pub connectable: bool,
    /// How much denser collisions are on it, in each channel, than where it may leave the scene without one; 1 unless they were
    /// forced.
    pub forcing: Spectrum,
    /// The branch that it left aside at its first specular event, if both were to be taken.
    pub split: Option<Box<Split>>,
    /// Whether it is [`End::Dead`] because it was lost, not absorbed.
    pub lost: bool,
}

impl<'a> Edge<'a> {
    /// Nothing but a start yet.
    pub(in crate::path) fn new(start: Start) -> Self {
        Edge {
            start,
            spans: Vec::new(),
            lead: 0,
            end: End::Dead,
            length: 0.0,
            weight: Spectrum::ONE,
            geometry: EdgeGeometry::new(),
            optical_length: 0.0,
            connectable: true,
            forcing: Spectrum::ONE,
            split: None,
            lost: false,
        }
    }

    /// Has the edge, which met nothing, end at a collision where the depth of a channel reaches a target: a point to scatter at,
    /// whose geometry term nobody asks for. Returns the number of its span, if there is one.
    pub(in crate::path) fn collide_at(&mut self, channel: usize, target: f64) -> Option<usize> {
        let at = |(i, span): (usize, &Span<'a>)| {
            let left = target - span.depth_before[channel];
            let part = (span.theta_end, span.length);
            let (theta, _) = span.attenuation.reach(&span.arc, part, channel, left);
            Some((i, span.at(theta?)))
        };
        let (span, point) = self.spans.iter().enumerate().find_map(at)?;
        self.length = point.length;
        self.optical_length = self.optical_length_to(&point);
        self.geometry = EdgeGeometry {
            depth: point.depth,
            ..EdgeGeometry::new()
        };
        self.end = End::Collision(point);
        Some(span)
    }

    /// Prepares the spans for many questions about their points.
    pub(crate) fn tabulate(&mut self) {
        for span in &mut self.spans {
            span.attenuation.tabulate(span.theta_end);
        }
    }

    /// Probability density per unit length of a collision at optical depth and extinction as in
    /// `point`, for channel probabilities `channel_pdf` (balance heuristic over channels, docs/theory.md#free-flight).
    pub(crate) fn collision_density(&self, channel_pdf: Spectrum, point: &Point) -> f64 {
        // Planted error "forced collisions weighed as by chance", found by morgana-transport/transport::first_vertex::single_scattering_has_no_variance:
        // (channel_pdf * point.rate * point.depth.exp_neg()).sum()
        // Planted error "distances weighted by one channel's density only", found by morgana-transport/transport::furnace::chromatic_extinction:
        // point.rate[0] * (-point.depth[0]).exp() * self.forcing[0]
        (channel_pdf * point.rate * point.depth.exp_neg() * self.forcing).sum()
    }

    /// What an edge that was sampled with channel probabilities `channel_pdf` carries to its end, over the
    /// density of its sampling: T σ_s/p at a collision, T/P on a surface.
    pub fn throughput(&self, scene: &Scene, channel_pdf: Spectrum) -> Spectrum {
        let transmittance = self.geometry.depth.exp_neg();
        match &self.end {
            End::Collision(point) => {
                let scattering = point.rate * point.albedo(scene);
                transmittance * point.weight * scattering
                    / self.collision_density(channel_pdf, point)
            }
            _ => transmittance * self.weight / self.geometry.survival(channel_pdf),
        }
    }

    /// The spans before the first specular event, as far as an edge can be extended.
    pub fn lead(&self) -> &[Span<'a>] {
        &self.spans[..self.lead]
    }

    /// The point at an arc length from the start, before the first specular event.
    pub(crate) fn at_length(&self, s: f64) -> Option<Point<'a>> {
        let lead = self.lead();
        let i = lead.partition_point(|span| span.length_after() < s);
        let span = lead.get(i).or(lead.last())?;
        let s = (s - span.length_before).clamp(0.0, span.length);
        Some(span.point(span.theta_at_length(s), s))
    }

    /// Optical path length from the start to a point of it before the first specular event.
    pub(crate) fn optical_length_to(&self, point: &Point) -> f64 {
        let mut length = 0.0;
        for span in self.lead() {
            if span.length_after() >= point.length {
                return length + span.arc.optical_length(point.theta);
            }
            length += span.arc.optical_length(span.theta_end);
        }
        length
    }
}
