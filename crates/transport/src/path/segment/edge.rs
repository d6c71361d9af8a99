//! Edges sampled from one end (docs/theory.md#edges-and-geometry-terms).

use super::edge_geometry::EdgeGeometry;
use crate::Spectrum;
use crate::medium::{Attenuation, MediumLabel};
use crate::scene::{MediumId, Scene};
use crate::shape::{Hit, Intersection};
use eikonal::ray::Arc;
use glam::DVec3;

/// Family of rays to which an edge belongs. Tangents of the edge are taken within the family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Front {
    /// All directions from one point.
    Point,
    /// A single direction, from all points of a plane across this direction.
    Plane,
}

/// Start of an edge.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Position.
    pub x: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Medium.
    pub medium: MediumId,
    /// Family of rays to which the edge belongs.
    pub(crate) front: Front,
    /// Object on whose surface the start lies, if a straight line from the start does not meet the
    /// object again.
    pub start_object: Option<usize>,
}

impl Start {
    /// Makes a start at a point, within the family of all directions.
    pub fn point(x: DVec3, direction: DVec3, medium: MediumId) -> Self {
        Start {
            x,
            direction,
            medium,
            front: Front::Point,
            start_object: None,
        }
    }
}

/// Quantity that a subpath carries along its edges. Radiance and importance differ at declared
/// index matches, and at surfaces with separate shading normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportMode {
    /// Basic radiance, towards its sources.
    Radiance,
    /// Importance along a light subpath, away from the emitter.
    Importance,
}

/// Arc of an edge within one medium.
#[derive(Clone, Debug)]
pub struct Span<'a> {
    /// Curve of the arc. Only the part θ ≤ `theta_end` belongs to the edge.
    pub arc: Arc,
    /// Parameter θ of `arc` at which the span ends, in (0, 1].
    pub theta_end: f64,
    /// Medium of the span.
    pub medium: MediumId,
    /// Extinction along the span.
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
    /// Object on whose surface the span ends, with the intersection; `None` if the span ends
    /// elsewhere.
    pub surface: Option<(usize, Intersection)>,
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
    /// Extinction, consistent with the depth.
    pub rate: Spectrum,
    /// Label of the voxel at the point, if it is known without a look-up in the voxels.
    pub(crate) label: Option<&'a MediumLabel>,
    /// Factor of the specular events before the point.
    pub weight: Spectrum,
}

impl<'a> Span<'a> {
    /// Returns the point at the parameter θ of the span's arc.
    pub fn at(&self, theta: f64) -> Point<'a> {
        self.point(theta, self.length_at(theta))
    }

    /// Returns the point at θ, given the arc length from the start of the span.
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

    /// Returns the arc length of the edge up to the end of this span.
    pub fn length_after(&self) -> f64 {
        self.length_before + self.length
    }

    /// Returns the arc length from the start of the span to θ.
    pub(crate) fn length_at(&self, theta: f64) -> f64 {
        self.arc.arc_length(theta)
    }

    /// Returns θ at which the arc length from the start of the span is `s`, limited to `theta_end`.
    pub fn theta_at_length(&self, s: f64) -> f64 {
        self.arc.theta_at_length(s).min(self.theta_end)
    }

    /// Returns θ at which the span comes closest to a point.
    pub fn closest_approach(&self, point: DVec3) -> f64 {
        self.arc.closest_approach(point).min(self.theta_end)
    }
}

impl Point<'_> {
    /// Returns the albedo of the medium at the point.
    #[inline]
    pub(crate) fn albedo(&self, scene: &Scene) -> Spectrum {
        let medium = || scene.medium(self.medium).albedo.at(self.x);
        self.label.map_or_else(medium, MediumLabel::albedo)
    }
}

/// End of an edge.
#[derive(Clone, Copy, Debug)]
pub enum End<'a> {
    /// A collision inside a medium.
    Collision(Point<'a>),
    /// A surface that scatters.
    Surface {
        /// Object of the surface.
        object: usize,
        /// Intersection with the surface.
        hit: Hit,
        /// Unit direction of arrival.
        direction: DVec3,
        /// Medium through which the edge arrives.
        medium: MediumId,
    },
    /// Escape from the scene.
    Escaped {
        /// Unit direction of the escape.
        direction: DVec3,
        /// Medium through which the edge leaves the scene.
        medium: MediumId,
    },
    /// Absorption at a specular surface, or loss of the ray.
    Dead,
}

/// The reflected branch of an edge that was followed along the refracted branch.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// Start of the branch.
    pub start: Start,
    /// Throughput of the branch at its start, relative to the throughput at the start of the edge.
    pub throughput: Spectrum,
    /// Optical path length from the start of the edge to the start of the branch.
    pub optical_length: f64,
    /// Probability with which an edge that is not split takes this branch.
    pub probability: f64,
}

/// An edge sampled from its start.
#[derive(Clone, Debug)]
pub struct Edge<'a> {
    /// Start of the edge.
    pub start: Start,
    /// Arcs up to the end of the edge. If the edge was extended, the arcs go beyond a collision, up
    /// to the first surface that is not index-matched. Empty unless spans were requested.
    pub spans: Vec<Span<'a>>,
    /// Number of spans before the first specular event or partial transmission. If the edge was
    /// extended beyond its collision, these spans depend only on the start, not on the collision.
    pub lead: usize,
    /// End of the edge.
    pub end: End<'a>,
    /// Arc length up to the end.
    pub length: f64,
    /// Factor of the specular events: reflectances, and n² across declared index matches.
    pub weight: Spectrum,
    /// Geometry of the edge, as connections need it.
    pub geometry: EdgeGeometry,
    /// Optical path length up to the end. For an edge that escapes, up to the place where light
    /// from that direction is taken to start (see [`super::lead_in`]).
    pub optical_length: f64,
    /// True if connections search for edges like this one: see [`crate::path`].
    pub connectable: bool,
    /// Density of collisions on the edge, in each channel, relative to an edge that may leave the
    /// scene without a collision. It is 1 unless the collision was forced.
    pub forcing: Spectrum,
    /// Branch that was not followed at the first specular event, if both branches were requested.
    pub split: Option<Box<Split>>,
    /// True if the edge is [`End::Dead`] because the ray was lost, not absorbed.
    pub lost: bool,
}

impl<'a> Edge<'a> {
    /// Makes an edge that has only a start.
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

    /// Ends the edge, which must have met no surface, at the collision where the depth of a channel
    /// reaches a target. The collision only scatters; its geometry term is not needed and stays 0.
    /// Returns the index of the span of the collision, if there is a collision.
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

    /// Prepares the spans for many queries about their points.
    pub(crate) fn tabulate(&mut self) {
        for span in &mut self.spans {
            span.attenuation.tabulate(span.theta_end);
        }
    }

    /// Returns the probability density per unit length of a collision with the optical depth and
    /// extinction of `point`. `channel_pdf` are the probabilities of channels, which the balance
    /// heuristic combines (docs/theory.md#free-flight).
    pub(crate) fn collision_density(&self, channel_pdf: Spectrum, point: &Point) -> f64 {
        // Planted error "forced collisions weighed as by chance", found by morgana-transport/transport::first_vertex::single_scattering_has_no_variance:
        // (channel_pdf * point.rate * point.depth.exp_neg()).sum()
        // Planted error "distances weighted by one channel's density only", found by morgana-transport/transport::furnace::chromatic_extinction:
        // point.rate[0] * (-point.depth[0]).exp() * self.forcing[0]
        (channel_pdf * point.rate * point.depth.exp_neg() * self.forcing).sum()
    }

    /// Returns the throughput up to the end of an edge sampled with channel probabilities
    /// `channel_pdf`, over the sampling density: T σ_s/p at a collision, T/P on a surface.
    pub fn throughput(&self, scene: &Scene, channel_pdf: Spectrum) -> Spectrum {
        let transmittance = self.geometry.depth.exp_neg();
        match &self.end {
            End::Collision(point) => {
                let scattering = point.rate * point.albedo(scene);
                transmittance * point.weight * scattering
                    / self.collision_density(channel_pdf, point)
            }
            _ => self.arrival(channel_pdf),
        }
    }

    /// Returns the throughput up to the end of an edge, over the sampling density, without the
    /// scattering there: T/p at a collision, T/P on a surface.
    pub(crate) fn arrival(&self, channel_pdf: Spectrum) -> Spectrum {
        let transmittance = self.geometry.depth.exp_neg();
        match &self.end {
            End::Collision(point) => {
                transmittance * point.weight / self.collision_density(channel_pdf, point)
            }
            _ => transmittance * self.weight / self.geometry.survival(channel_pdf),
        }
    }

    /// Returns the spans before the first specular event or partial transmission.
    pub fn lead(&self) -> &[Span<'a>] {
        &self.spans[..self.lead]
    }

    /// Returns the point at an arc length from the start, before the first specular event.
    pub(crate) fn at_length(&self, s: f64) -> Option<Point<'a>> {
        let lead = self.lead();
        let i = lead.partition_point(|span| span.length_after() < s);
        let span = lead.get(i).or(lead.last())?;
        let s = (s - span.length_before).clamp(0.0, span.length);
        Some(span.point(span.theta_at_length(s), s))
    }

    /// Returns the optical path length from the start to a point of the edge before the first
    /// specular event.
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
