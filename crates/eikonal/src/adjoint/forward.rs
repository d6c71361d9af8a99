//! Forward mode: the change of a ray's end for changes of its start, the fields and the surfaces
//! (docs/theory.md#derivatives-of-rays).

use super::follow::{AdjointRay, Passed, Segment};
use crate::connect::World;
use crate::field::IndexChange;
use crate::interface::{Displacement, Interface, Rule};
use crate::ray::{DRIFT, KICK, STAGES, Tangents};
use glam::DVec3;

/// A change of the world that rays travel through.
pub trait WorldChange<R> {
    /// Returns the change of n² and ∇n² at `x`.
    fn index(&self, region: R, x: DVec3) -> IndexChange;

    /// Returns the displacement of the surface with the identifier `surface`, at `x`.
    fn surface(&self, surface: usize, x: DVec3) -> Displacement {
        let _ = (surface, x);
        Displacement::default()
    }

    /// Returns the displacement of the receiver along its normal, where a ray ends at `x`.
    fn receiver(&self, x: DVec3) -> f64 {
        let _ = x;
        0.0
    }
}

/// A change of the start of a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StartChange {
    /// Change of the position.
    pub x: DVec3,
    /// Change of the unit direction, perpendicular to it.
    pub direction: DVec3,
}

/// A change of the end of a ray on the receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EndChange {
    /// Change of the position.
    pub x: DVec3,
    /// Change of the velocity.
    pub v: DVec3,
    /// Change of the optical path length.
    pub optical_length: f64,
}

impl EndChange {
    /// Returns the change of the unit direction v/|v|.
    pub fn direction(&self, v: DVec3) -> DVec3 {
        self.v.reject_from(v) / v.length()
    }
}

/// A state of the ray and its change, at equal σ.
struct Changed {
    x: DVec3,
    v: DVec3,
    of_x: DVec3,
    of_v: DVec3,
    of_length: f64,
}

impl<W: World> AdjointRay<'_, W> {
    /// Returns the change of the end of the ray traced last, for changes of its start and of the
    /// world: the transpose of [`AdjointRay::pull_back`]. `None` if the ray has no end.
    pub fn push_forward(
        &self,
        start: &StartChange,
        change: &impl WorldChange<W::Region>,
    ) -> Option<EndChange> {
        let (begin, end, last) = (self.start?, self.end?, self.segments.last()?);
        let (n2, grad) = self.world.field(begin.region).gradient(begin.x);
        let n = n2.sqrt();
        let of_n2 = change.index(begin.region, begin.x).n2 + grad.dot(start.x);
        let v = begin.direction * n;
        let mut state = Changed {
            x: begin.x,
            v,
            of_x: start.x,
            of_v: start.direction * n + begin.direction * (of_n2 / (2.0 * n)),
            of_length: -v.dot(start.x),
        };
        // Advance over all surfaces and segments.
        for (i, segment) in self.segments.iter().enumerate() {
            if let Some(passed) = &segment.passed {
                state.pass(self, passed, change)?;
            }
            let next = self.segments.get(i + 1);
            state.segment(
                self,
                segment,
                next.map_or(self.spans.len(), |next| next.first),
                change,
            );
        }
        // Move the end onto the receiver.
        let a = 0.5 * self.world.field(last.region).gradient(end.x).1;
        let missing = change.receiver(end.x) - self.normal.dot(state.of_x);
        let span = missing / self.normal.dot(end.v);
        let of_x = state.of_x + end.v * span;
        Some(EndChange {
            x: of_x,
            v: state.of_v + a * span,
            optical_length: state.of_length + end.v.dot(of_x),
        })
    }
}

impl Changed {
    /// Advances over the steps of a segment, up to the step before index `beyond`.
    fn segment<W: World>(
        &mut self,
        ray: &AdjointRay<W>,
        segment: &Segment<W::Region>,
        beyond: usize,
        change: &impl WorldChange<W::Region>,
    ) {
        let mut kick = 0.0;
        for &h in &ray.spans[segment.first..beyond] {
            kick += KICK[0] * h;
            for (drift, after) in STAGES {
                self.kick(ray, segment.region, kick, change);
                self.x += self.v * (DRIFT[drift] * h);
                self.of_x += self.of_v * (DRIFT[drift] * h);
                kick = KICK[after] * h;
            }
        }
        if beyond > segment.first {
            self.kick(ray, segment.region, kick, change);
        }
    }

    fn kick<W: World>(
        &mut self,
        ray: &AdjointRay<W>,
        region: W::Region,
        h: f64,
        change: &impl WorldChange<W::Region>,
    ) {
        let of = change.index(region, self.x);
        self.of_v += of.gradient * (0.5 * h);
        self.of_length += 0.5 * h * of.n2;
        let field = ray.world.field(region);
        if !field.is_constant() {
            let jet = field.jet(self.x);
            self.v += jet.grad * (0.5 * h);
            self.of_v += jet.hess * self.of_x * (0.5 * h);
        }
    }

    /// Advances through a surface.
    fn pass<W: World>(
        &mut self,
        ray: &AdjointRay<W>,
        passed: &Passed<W::Region>,
        change: &impl WorldChange<W::Region>,
    ) -> Option<()> {
        let (interface, before) = (&passed.interface, passed.before);
        let columns = Tangents {
            dx: [self.of_x, DVec3::ZERO],
            dv: [self.of_v, DVec3::ZERO],
        };
        let mapped = interface.tangents(passed.rule, before, &columns)?;
        let moved = change.surface(passed.surface, passed.x);
        let (dx, dv) = interface.displaced(passed.rule, [before, passed.after], moved);
        let normal = interface.normal;
        let late = (moved.offset - normal.dot(self.of_x)) / normal.dot(before);
        let hit = self.of_x + before * late;
        self.of_length += (before - passed.after).dot(hit);
        let [near, far] = [passed.near, passed.far].map(|r| change.index(r, passed.x).n2);
        self.of_x = mapped.dx[0] + dx;
        self.of_v = mapped.dv[0] + dv + of_indices(interface, passed, [near, far]);
        let off = ray.world.ray_epsilon().copysign(normal.dot(passed.after));
        self.x = passed.x + normal * off;
        self.v = passed.after;
        Some(())
    }
}

/// Returns the change of the velocity behind a surface with n² on the near and on the far side.
fn of_indices<R>(interface: &Interface, passed: &Passed<R>, [near, far]: [f64; 2]) -> DVec3 {
    let (normal, after) = (interface.normal, passed.after);
    match passed.rule {
        Rule::Reflect => DVec3::ZERO,
        Rule::Refract => normal * ((far - near) / (2.0 * normal.dot(after))),
        Rule::Pass => after * (0.5 * (far / interface.far.0 - near / interface.near.0)),
    }
}
