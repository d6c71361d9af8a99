//! Two regions with a surface between them, and a tracer of rays through it.

use glam::{DMat3, DVec3};
use morgana_eikonal::connect::{Crossing, World};
use morgana_eikonal::interface::{Interface, Rule};
use morgana_eikonal::ray::bernstein::{first_root, height, product};
use morgana_eikonal::ray::{Arc, Flow, Node, Tangents, perpendicular_basis};
use morgana_eikonal::{Field, Tolerance, Work};

/// Two fields and the surface between them.
pub struct TwoRegions {
    pub surface: Surface,
    /// Fields on both sides: first the side that the normal points away from (the inside of a
    /// ball), then the other.
    pub fields: [Field; 2],
    pub rule: Rule,
}

#[derive(Clone, Copy)]
pub enum Surface {
    /// A plane through a point, with a unit normal.
    Plane(DVec3, DVec3),
    /// A ball with centre and radius.
    Ball(DVec3, f64),
}

impl Surface {
    /// Returns the unit normal and the shape operator at a point of the surface.
    fn at(&self, x: DVec3) -> (DVec3, DMat3) {
        match *self {
            Surface::Plane(_, normal) => (normal, DMat3::ZERO),
            Surface::Ball(center, radius) => {
                let n = (x - center) / radius;
                let along = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
                (n, (DMat3::IDENTITY - along) * (1.0 / radius))
            }
        }
    }

    /// Returns the first θ at which an arc that starts off the surface meets it.
    fn first(&self, arc: &Arc) -> Option<f64> {
        let control = &arc.control();
        match *self {
            Surface::Plane(p, normal) => {
                first_root(&height(control, p, normal), 0.0, 1.0, [0.0; 2])
            }
            Surface::Ball(center, radius) => {
                let squares = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                    let c = height(control, center, axis);
                    product::<6, 6, 11>(&c, &c)
                });
                let [x, y, z] = squares;
                let f = std::array::from_fn::<f64, 11, _>(|i| x[i] + y[i] + z[i] - radius * radius);
                first_root(&f, 0.0, 1.0, [0.0; 2])
            }
        }
    }
}

impl World for TwoRegions {
    type Region = usize;

    fn field(&self, region: usize) -> &Field {
        &self.fields[region]
    }

    fn crossing(&self, region: usize, arc: &Arc) -> Option<Crossing<usize>> {
        let theta = self.surface.first(arc)?;
        let position = arc.position(theta);
        let (normal, shape) = self.surface.at(position);
        Some(Crossing {
            theta,
            position,
            normal,
            shape,
            rule: self.rule,
            beyond: 1 - region,
            surface: 0,
        })
    }

    fn ray_epsilon(&self) -> f64 {
        1e-11
    }
}

/// Traces a ray with tangents from `region` over a span of σ, through all surfaces that it meets.
/// The code is independent of the solver's own loop. Returns also the number of events.
#[allow(dead_code)] // Not by all who use these worlds.
pub fn trace(world: &TwoRegions, x: DVec3, direction: DVec3, sigma: f64) -> (Node<Tangents>, u32) {
    let mut region = 1;
    let tangents = Tangents::angular(world.fields[1].n(x), perpendicular_basis(direction));
    let mut node = Node::start(&world.fields[1], x, direction, tangents);
    let (mut left, mut events, mut work) = (sigma, 0, Work::default());
    loop {
        let mut flow = Flow::new(&world.fields[region], node, Tolerance::new(1e-12));
        let crossing = loop {
            let step = flow.advance(left, &mut work);
            if let Some(crossing) = world.crossing(region, &step.arc) {
                left -= step.arc.h() * crossing.theta;
                node = Node::new(
                    &world.fields[region],
                    crossing.position,
                    step.at(crossing.theta).1,
                    step.at(crossing.theta).2,
                );
                break crossing;
            }
            left -= step.arc.h();
            if left <= 1e-14 {
                return (step.end, events);
            }
        };
        let far = Node::new(&world.fields[1 - region], node.x, node.v, ());
        let interface = Interface {
            normal: crossing.normal,
            shape: crossing.shape,
            near: (node.n2, node.a),
            far: (far.n2, far.a),
        };
        let after = interface
            .velocity(world.rule, node.v)
            .expect("not totally reflected");
        let variation = interface
            .tangents(world.rule, node.v, &node.variation)
            .unwrap();
        if world.rule != Rule::Reflect {
            region = 1 - region;
        }
        let off = crossing.normal * world.ray_epsilon().copysign(crossing.normal.dot(after));
        node = Node::new(&world.fields[region], node.x + off, after, variation);
        events += 1;
    }
}
