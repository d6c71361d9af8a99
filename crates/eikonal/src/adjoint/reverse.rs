//! Reverse mode: derivatives taken back along a ray (docs/theory.md#derivatives-of-rays).

use super::follow::{AdjointRay, Passed, Segment};
use crate::connect::World;
use crate::field::IndexDerivative;
use crate::interface::{Displacement, Interface, Rule};
use crate::ray::{DRIFT, KICK, STAGES, Tangents};
use glam::DVec3;

/// Derivative of a loss with respect to the end of a ray on the receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EndDerivative {
    /// Derivative with respect to the position.
    pub x: DVec3,
    /// Derivative with respect to the velocity.
    pub v: DVec3,
    /// Derivative with respect to the optical path length.
    pub optical_length: f64,
}

impl EndDerivative {
    /// Creates the derivative of a loss that depends on the unit direction v/|v| instead of the
    /// velocity.
    pub fn of_direction(x: DVec3, direction: DVec3, optical_length: f64, v: DVec3) -> Self {
        let n = v.length();
        let unit = v / n;
        EndDerivative {
            x,
            v: (direction - unit * unit.dot(direction)) / n,
            optical_length,
        }
    }
}

/// Derivative of a loss with respect to the start of a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StartDerivative {
    /// Derivative with respect to the position, at a fixed direction.
    pub x: DVec3,
    /// Derivative with respect to the unit direction, perpendicular to it.
    pub direction: DVec3,
}

/// Derivative of a loss with respect to the [`Displacement`] of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceDerivative {
    /// Derivative with respect to the offset along the normal.
    pub offset: f64,
    /// Derivative with respect to the turn of the normal.
    pub turn: DVec3,
}

/// Destination for derivatives of a loss with respect to the fields of regions and, optionally, to
/// surfaces.
pub trait IndexSink<R> {
    /// Adds the derivative with respect to n² and ∇n² at `x`.
    fn add(&mut self, region: R, x: DVec3, by: IndexDerivative);

    /// Adds the derivative with respect to the surface with the identifier `surface`, which the ray
    /// meets at `x`.
    fn add_surface(&mut self, surface: usize, x: DVec3, by: SurfaceDerivative) {
        let _ = (surface, x, by);
    }

    /// Adds the derivative with respect to the offset of the receiver along its normal, where the
    /// ray ends at `x`.
    fn add_receiver(&mut self, x: DVec3, by_offset: f64) {
        let _ = (x, by_offset);
    }
}

/// Ignores all derivatives.
impl<R> IndexSink<R> for () {
    fn add(&mut self, _: R, _: DVec3, _: IndexDerivative) {}
}

/// A state of the ray and the derivative of the loss with respect to it, at equal σ.
#[derive(Clone, Copy)]
pub(super) struct Adjoint {
    pub(super) x: DVec3,
    pub(super) v: DVec3,
    pub(super) by_x: DVec3,
    pub(super) by_v: DVec3,
    pub(super) by_length: f64,
}

impl<W: World> AdjointRay<'_, W> {
    /// Takes the derivative of a loss back from the end of the last traced ray to its start. Passes
    /// derivatives with respect to the fields to `sink`. Returns `None` if the ray has no end.
    pub fn pull_back(
        &self,
        loss: &EndDerivative,
        sink: &mut impl IndexSink<W::Region>,
    ) -> Option<StartDerivative> {
        let (start, end, last) = (self.start?, self.end?, self.segments.last()?);
        let a = 0.5 * self.world.field(last.region).gradient(end.x).1;
        let mut adjoint = Adjoint {
            x: end.x,
            v: end.v,
            by_x: loss.x + end.v * loss.optical_length,
            by_v: loss.v,
            by_length: loss.optical_length,
        };
        // Keep the end on the receiver, which may be moved by w: δx + v δσ, δv + a δσ with δσ = (w
        // − N·δx)/(N·v).
        let by_span = adjoint.by_x.dot(end.v) + adjoint.by_v.dot(a);
        let by_offset = by_span / self.normal.dot(end.v);
        // Planted error "receivers whose move does not matter", found by morgana-eikonal/eikonal::adjoint::surfaces::rays_through_sequences_of_surfaces:
        // sink.add_receiver(end.x, 0.0 * by_offset);
        sink.add_receiver(end.x, by_offset);
        adjoint.by_x -= self.normal * by_offset;
        // Go back over all segments and surfaces.
        let mut beyond = self.spans.len();
        for segment in self.segments.iter().rev() {
            adjoint.segment(self, segment, beyond, sink);
            beyond = segment.first;
            if let Some(passed) = &segment.passed {
                adjoint.pass(passed, sink);
            }
        }
        // Convert to derivatives with respect to the position and the direction.
        let (n2, grad) = self.world.field(start.region).gradient(start.x);
        let n = n2.sqrt();
        let along = start.direction.dot(adjoint.by_v);
        let by = IndexDerivative {
            n2: along / (2.0 * n),
            gradient: DVec3::ZERO,
        };
        sink.add(start.region, start.x, by);
        Some(StartDerivative {
            x: adjoint.by_x + grad * (along / (2.0 * n))
                - start.direction * (n * loss.optical_length),
            direction: (adjoint.by_v - start.direction * along) * n,
        })
    }
}

impl Adjoint {
    /// Goes back over the steps of a segment, from the step before index `beyond`. The last kick of
    /// a step and the first kick of the next step are combined.
    fn segment<W: World>(
        &mut self,
        ray: &AdjointRay<W>,
        segment: &Segment<W::Region>,
        beyond: usize,
        sink: &mut impl IndexSink<W::Region>,
    ) {
        let mut kick = 0.0;
        for &h in ray.spans[segment.first..beyond].iter().rev() {
            for (drift, after) in STAGES.into_iter().rev() {
                self.kick(ray, segment.region, kick + KICK[after] * h, sink);
                kick = 0.0;
                self.drift(DRIFT[drift] * h);
            }
            kick = KICK[0] * h;
        }
        if beyond > segment.first {
            self.kick(ray, segment.region, kick, sink);
        }
    }

    /// Goes back over x += h v.
    fn drift(&mut self, h: f64) {
        self.x -= self.v * h;
        self.by_v += self.by_x * h;
    }

    /// Goes back over v += ½h∇n², and over the contribution of n² to the optical length.
    fn kick<W: World>(
        &mut self,
        ray: &AdjointRay<W>,
        region: W::Region,
        h: f64,
        sink: &mut impl IndexSink<W::Region>,
    ) {
        let by = IndexDerivative {
            n2: 0.5 * h * self.by_length,
            gradient: self.by_v * (0.5 * h),
        };
        sink.add(region, self.x, by);
        let field = ray.world.field(region);
        if !field.is_constant() {
            let jet = field.jet(self.x);
            self.v -= jet.grad * (0.5 * h);
            // Planted error "derivatives of rays that forget how forces vary", found by morgana-eikonal/eikonal::adjoint::parameters::rays_by_parameters_and_starts:
            // (no line)
            self.by_x += jet.hess * self.by_v * (0.5 * h);
        }
    }

    /// Goes back through a surface.
    fn pass<R: Copy>(&mut self, passed: &Passed<R>, sink: &mut impl IndexSink<R>) {
        let Passed {
            interface,
            rule,
            before,
            after,
            ..
        } = passed;
        let [near, far] = self.by_indices(interface, *rule, *before, *after);
        let value = |n2| IndexDerivative {
            n2,
            gradient: DVec3::ZERO,
        };
        sink.add(passed.near, passed.x, value(near));
        sink.add(passed.far, passed.x, value(far));
        // Planted error "derivatives of rays that pass surfaces unchanged", found by morgana-eikonal/eikonal::adjoint::surfaces::rays_through_balls_and_planes:
        // let (by_x, by_v) = (self.by_x, self.by_v);
        let (by_x, by_v) = self.transposed(interface, *rule, *before);
        // Add the change of the optical length by (v − v′)·δx_h. The point moves by δx_h = δx + v
        // (w − N·δx)/(N·v) on the surface, which moves by w.
        let turned = (*before - *after) * self.by_length;
        let normal = interface.normal;
        let slide = before.dot(turned) / normal.dot(*before);
        let slid = turned - normal * slide;
        let mut by = self.by_surface(interface, *rule, [*before, *after]);
        // Planted error "optical lengths that forget how surfaces move", found by morgana-eikonal/eikonal::adjoint::surfaces::rays_through_sequences_of_surfaces:
        // by.offset += 0.0 * slide;
        by.offset += slide;
        sink.add_surface(passed.surface, passed.x, by);
        *self = Adjoint {
            x: passed.x,
            v: *before,
            by_x: by_x + slid,
            by_v,
            ..*self
        };
    }

    /// Converts the derivative with respect to the velocity behind the surface to derivatives with
    /// respect to n² on the near and on the far side.
    pub(super) fn by_indices(
        &self,
        interface: &Interface,
        rule: Rule,
        before: DVec3,
        after: DVec3,
    ) -> [f64; 2] {
        match rule {
            Rule::Reflect => [0.0; 2],
            Rule::Refract => {
                let normal = interface.normal;
                let by_far = normal.dot(self.by_v) / (2.0 * normal.dot(after));
                [-by_far, by_far]
            }
            Rule::Pass => {
                let ([near, far], by_after) =
                    ([interface.near.0, interface.far.0], after.dot(self.by_v));
                debug_assert!(before.dot(after) > 0.0);
                [-by_after / (2.0 * near), by_after / (2.0 * far)]
            }
        }
    }

    /// Transposes the map from a displacement of the surface to the tangents, column by column.
    fn by_surface(
        &self,
        interface: &Interface,
        rule: Rule,
        velocities: [DVec3; 2],
    ) -> SurfaceDerivative {
        let by = |moved| {
            let (dx, dv) = interface.displaced(rule, velocities, moved);
            dx.dot(self.by_x) + dv.dot(self.by_v)
        };
        let turned = |turn| by(Displacement { offset: 0.0, turn });
        SurfaceDerivative {
            offset: by(Displacement {
                offset: 1.0,
                turn: DVec3::ZERO,
            }),
            turn: DVec3::from_array(DVec3::AXES.map(turned)),
        }
    }

    /// Transposes the map of tangents through the surface, column by column.
    pub(super) fn transposed(
        &self,
        interface: &Interface,
        rule: Rule,
        before: DVec3,
    ) -> (DVec3, DVec3) {
        let mut by = [DVec3::ZERO; 2];
        for (axis, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            let columns = Tangents {
                dx: [unit, DVec3::ZERO],
                dv: [DVec3::ZERO, unit],
            };
            // The rule is possible: it has been applied before.
            if let Some(mapped) = interface.tangents(rule, before, &columns) {
                for (k, by) in by.iter_mut().enumerate() {
                    by[axis] = mapped.dx[k].dot(self.by_x) + mapped.dv[k].dot(self.by_v);
                }
            }
        }
        (by[0], by[1])
    }
}
