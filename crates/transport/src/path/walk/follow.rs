//! One ray from the sensor on: unscattered, on the path that Snell's law and mirrors leave no choice of.

use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::budget::STEPS_PER_RAY;
use crate::medium::Attenuation;
use crate::path::segment::leave;
use crate::path::workspace::Workspace;
use crate::scene::{MediumId, Scene};
use crate::shape::Hit;
use eikonal::connect::World;
use eikonal::interface::{Interface, Rule};
use eikonal::ray::{Arc, Flow, Node, Work};
use eikonal::{PathDifference, Reference};
use glam::{DMat3, DVec3};

/// How a ray that was followed ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// On an object that passes no ray on in one direction.
    Surface(usize),
    /// It left the scene.
    Left,
    /// It left its medium's field, took too many steps, so that it may be trapped, or no ray of the reference joins its
    /// ends.
    Lost,
}

/// A ray up to an opaque surface, or up to the last boundary if it left the scene; up to its start if it
/// met nothing at all.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FollowedRay {
    /// Position of its end.
    pub x: DVec3,
    /// Unit direction there, beyond a boundary.
    pub direction: DVec3,
    /// Arc length.
    pub length: f64,
    /// ∫n ds.
    pub optical_length: f64,
    /// ∫n ds less that of rays of the reference: see [`PathDifference`]. Zero without one.
    pub path_difference: f64,
    /// Optical depth.
    pub depth: Spectrum,
    /// Number of arcs, the last one out of the scene included.
    pub steps: u64,
    /// How it ended.
    pub ending: Ending,
    /// The first surface that does more than delimit media, if there is one.
    pub seen: Option<SeenSurface>,
}

/// The first surface on the way of a ray that does more than delimit media.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeenSurface {
    /// Its number.
    pub object: usize,
    /// Where it is met.
    pub hit: Hit,
    /// Unit direction of the ray before it.
    pub direction: DVec3,
    /// The medium through which the ray arrives.
    pub medium: MediumId,
    /// Arc length up to there.
    pub length: f64,
}

/// Where a ray is followed to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Until {
    /// The first surface that does more than delimit media.
    Seen,
    /// The first that leaves it no single direction.
    Scattered,
}

/// Follows the ray from `x` in a unit direction: on through index-matched boundaries, refracted by
/// smooth dielectrics, or totally reflected, reflected by smooth metals, and straight through what lets at
/// least half of the light pass. With a `reference` its optical path difference is found, too.
pub(crate) fn follow(
    scene: &Scene,
    x: DVec3,
    direction: DVec3,
    medium: MediumId,
    reference: Option<Reference<'_>>,
    ws: &mut Workspace,
) -> FollowedRay {
    let follower = Follower::new(scene, x, direction, medium);
    let difference = reference.map(|reference| PathDifference::new(reference, direction));
    run(
        Follower {
            difference,
            ..follower
        },
        ws,
    )
}

/// Follows the ray from `x` in a unit direction through null boundaries, up to the first other surface.
pub(crate) fn see(
    scene: &Scene,
    x: DVec3,
    direction: DVec3,
    medium: MediumId,
    ws: &mut Workspace,
) -> FollowedRay {
    let follower = Follower::new(scene, x, direction, medium);
    run(
        Follower {
            until: Until::Seen,
            ..follower
        },
        ws,
    )
}

fn run(mut follower: Follower, ws: &mut Workspace) -> FollowedRay {
    let mut ending = loop {
        if let Some(ending) = follower.region(ws) {
            break ending;
        }
    };
    let mut compared = follower.difference;
    let difference = compared
        .as_mut()
        .map(|compared| compared.value(&mut ws.stats.work));
    let is_over_budget = compared.is_some_and(|compared| compared.is_over_budget());
    if difference.is_some_and(f64::is_nan) {
        ending = Ending::Lost;
    }
    ws.stats.over_budget.rays += u64::from(is_over_budget);
    ws.stats.lost += u64::from(ending == Ending::Lost);
    FollowedRay {
        ending,
        path_difference: difference.unwrap_or(0.0),
        ..follower.ray
    }
}

struct Follower<'a> {
    scene: &'a Scene,
    x: DVec3,
    v: DVec3,
    medium: MediumId,
    difference: Option<PathDifference<'a>>,
    until: Until,
    ray: FollowedRay,
}

impl<'a> Follower<'a> {
    fn new(scene: &'a Scene, x: DVec3, direction: DVec3, medium: MediumId) -> Self {
        Follower {
            scene,
            x,
            v: direction * scene.n(medium, x),
            medium,
            difference: None,
            until: Until::Scattered,
            ray: FollowedRay {
                x,
                direction,
                length: 0.0,
                optical_length: 0.0,
                path_difference: 0.0,
                depth: Spectrum::ZERO,
                steps: 0,
                ending: Ending::Lost,
                seen: None,
            },
        }
    }

    /// Follows the ray through one medium. Returns how it ended, unless it goes on into another.
    fn region(&mut self, ws: &mut Workspace) -> Option<Ending> {
        let scene = self.scene;
        let field = scene.field(self.medium);
        let node = Node::new(field, self.x, self.v, ());
        let mut flow = Flow::new(field, node, ws.tolerance());
        loop {
            let reach = scene.reach(flow.node().x);
            let step = flow.advance(reach / flow.node().v.length(), &mut ws.stats.work);
            self.ray.steps += 1;
            let is_over = self.ray.steps > STEPS_PER_RAY as u64;
            ws.stats.over_budget.rays += u64::from(is_over);
            if !step.end.x.is_finite() || is_over {
                return Some(Ending::Lost);
            }
            match scene.first_hit(&step.arc) {
                Some((object, hit)) => {
                    self.lengthen(&step.arc, hit.theta, &mut ws.stats.work);
                    return self.surface(object, &hit, step.arc.velocity(hit.theta), ws);
                }
                None if field.is_constant() => return Some(Ending::Left),
                None => self.lengthen(&step.arc, 1.0, &mut ws.stats.work),
            }
            if scene.is_outside(step.end.x) || ws.stop.is_raised() {
                return Some(Ending::Lost);
            }
        }
    }

    fn lengthen(&mut self, arc: &Arc, theta: f64, work: &mut Work) {
        let attenuation = Attenuation::new(self.scene.medium(self.medium), arc, theta);
        let [arc_length, optical_length] = arc.lengths(theta);
        self.ray.depth += attenuation.depth(theta, arc_length);
        self.ray.length += arc_length;
        self.ray.optical_length += optical_length;
        if let Some(difference) = &mut self.difference {
            difference.add(self.scene.field(self.medium), arc, [0.0, theta], work);
        }
    }

    /// Goes on from a surface if there is only one direction to go.
    fn surface(
        &mut self,
        object: usize,
        hit: &Hit,
        v: DVec3,
        ws: &mut Workspace,
    ) -> Option<Ending> {
        let scene = self.scene;
        self.ray.x = hit.position;
        self.ray.direction = v.normalize();
        let is_null = scene.objects()[object].bsdf.is_null();
        if self.ray.seen.is_none() && !is_null {
            self.ray.seen = Some(SeenSurface {
                object,
                hit: *hit,
                direction: self.ray.direction,
                medium: self.medium,
                length: self.ray.length,
            });
            if self.until == Until::Seen {
                return Some(Ending::Surface(object));
            }
        }
        let Some(passage) = unscattered_continuation(scene, object, self.medium, hit, v) else {
            return Some(Ending::Surface(object));
        };
        self.x = passage.x;
        self.v = passage.v;
        self.medium = passage.medium;
        self.ray.direction = self.v.normalize();
        if passage.is_reflection
            && let Some(difference) = &mut self.difference
        {
            difference.reflect(self.ray.direction, &mut ws.stats.work);
        }
        None
    }
}

/// The way of a ray beyond a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Continuation {
    /// Start of the ray, off the surface.
    pub x: DVec3,
    /// Its velocity there.
    pub v: DVec3,
    /// The medium into which it goes.
    pub medium: MediumId,
    /// True if it stays on its side of the surface.
    pub is_reflection: bool,
}

/// The way beyond a surface for a ray that arrives through a medium with a velocity, if the surface leaves it one direction, or lets
/// at least half of its light pass straight on. `None` if the ray ends there.
pub(crate) fn unscattered_continuation(
    scene: &Scene,
    object: usize,
    medium: MediumId,
    hit: &Hit,
    v: DVec3,
) -> Option<Continuation> {
    let surface = &scene.objects()[object];
    let site = surface.shape.site(hit);
    let cos = hit.normal.dot(v.normalize());
    let rule = match surface.bsdf.through(&site, cos) {
        Some(through) if through.probability >= 0.5 => Rule::Pass,
        _ => rule(&surface.bsdf, cos < 0.0)?,
    };
    let beyond = scene.medium_beside(object, medium, hit.position, hit.normal, v);
    let n2 = |medium| (scene.field(medium).n2(hit.position), DVec3::ZERO);
    let interface = Interface {
        normal: match rule {
            Rule::Reflect => surface.shape.shading_normal(&site, hit.normal),
            Rule::Refract | Rule::Pass => hit.normal,
        },
        shape: DMat3::ZERO,
        near: n2(medium),
        far: n2(beyond),
    };
    // The arc's speed is the index up to the tolerance: here it becomes the index again.
    let v = v.normalize() * interface.near.0.sqrt();
    let passed = interface.velocity(rule, v);
    let is_reflection = passed.is_none() || rule == Rule::Reflect;
    let after = passed
        .or_else(|| interface.velocity(Rule::Reflect, v))
        .unwrap_or(-v);
    // A shading normal may have a mirror send rays below the surface.
    let is_below = hit.normal.dot(after) * hit.normal.dot(v) >= 0.0;
    if rule == Rule::Reflect && is_below {
        return None;
    }
    Some(Continuation {
        x: leave(scene, hit.position, hit.normal, after),
        v: after,
        medium: if is_reflection { medium } else { beyond },
        is_reflection,
    })
}

/// The only rule that a surface leaves to light that arrives on the side of its normal, or behind.
fn rule(bsdf: &Bsdf, front: bool) -> Option<Rule> {
    match bsdf {
        Bsdf::Null => Some(Rule::Pass),
        Bsdf::Dielectric(_) => Some(Rule::Refract),
        Bsdf::Conductor(_) if front => Some(Rule::Reflect),
        Bsdf::TwoSided(b) => rule(&b.sides()[usize::from(!front)], true),
        _ => None,
    }
}
