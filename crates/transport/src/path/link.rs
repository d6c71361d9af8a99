//! Edges made by connection: from a vertex to an emitter.

use super::Workspace;
use super::edge::Edge;
use super::vertex::Vertex;
use crate::Spectrum;
use crate::bsdf::Bsdf;
use crate::emitter::Aim;
use crate::medium::Attenuation;
use crate::scene::{MediumId, Scene};
use eikonal::connect::{Connection, Event, Piece, Start, World};
use eikonal::interface::Rule;
use glam::DVec3;

/// Directions closer than this, in radians, are those of one branch, and closer than this multiple of
/// the rays' tolerance: the solver is no better than the rays that it shoots.
const SAME_WAY: (f64, f64) = (1e-4, 100.0);

/// A grazing ray touches the surface on which it ends this many times its miss before the end.
const SLACK_PER_MISS: f64 = 1e3;
/// Likewise for the distance by which ends are kept off surfaces.
const SLACK_PER_NUDGE: f64 = 1e3;

/// A ray between a vertex and an emitter, seen from the vertex.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Unit direction at the vertex, towards the light.
    pub direction: DVec3,
    /// Where the light starts.
    pub origin: DVec3,
    /// Unit direction in which the light leaves the emitter.
    pub emission: DVec3,
    /// Optical depth.
    pub depth: Spectrum,
    /// Factor of the interfaces on the way, Fresnel's included.
    pub factor: Spectrum,
    /// Probability that an edge sampled by chance makes the same choices at these interfaces.
    pub choice: f64,
    /// Number of refractions and total reflections.
    pub events: u32,
    /// Span of σ.
    pub sigma: f64,
    /// How far the ray passes from the point that it was aimed at.
    pub miss: f64,
    /// 1/(J n_e²) for a point, 1/(A n_x²) for a plane (theory §3): turns what is emitted into what
    /// a basic-radiance vertex receives.
    pub geometry: f64,
    /// Density per steradian at the vertex of a unit density on the emitter: J/cos θ for a point on a
    /// surface, A n_x²/n_e² for a plane.
    pub density: f64,
}

impl Link {
    /// Connects a vertex to an emitter and hands every ray that is found and not blocked to `visit`:
    /// the primary branch, or for a beam one branch from each start of its guide. Every attempt and
    /// its outcome is counted.
    pub fn each(
        scene: &Scene,
        vertex: &Vertex,
        aim: &Aim,
        emitter: usize,
        ws: &mut Workspace,
        mut visit: impl FnMut(&Link),
    ) {
        let mut offer = |link: Option<Link>, target: Option<usize>, ws: &mut Workspace| {
            let Some(link) = link else { return };
            let slack = SLACK_PER_MISS * link.miss + SLACK_PER_NUDGE * scene.nudge();
            if scene.is_occluded(ws.solver.pieces(), target, slack) {
                ws.stats.connections.occluded += 1;
            } else {
                visit(&link);
            }
        };
        match *aim {
            Aim::Point { position, surface } => {
                let link = to_point(scene, vertex, position, surface.map(|s| s.1), ws);
                offer(link, surface.map(|s| s.0), ws);
            }
            Aim::Plane {
                through,
                direction,
                beam: false,
            } => {
                let link = to_plane(scene, vertex, (through, direction), None, ws);
                offer(link, vertex.object(), ws);
            }
            Aim::Plane {
                through,
                direction,
                beam: true,
            } => {
                let x = vertex.position();
                let mut found: Vec<Link> = Vec::new();
                for start in scene.guide(emitter).map_or(Vec::new(), |g| g.starts(x)) {
                    let link = to_plane(scene, vertex, (through, direction), Some(start), ws);
                    // Several starts may lead to one branch.
                    let known = |l: &Link| found.iter().any(|f| f.is_branch_of(scene, l));
                    if let Some(link) = link.filter(|l| !known(l)) {
                        found.push(link);
                        offer(Some(link), vertex.object(), ws);
                    }
                }
            }
        }
    }

    /// The connection that would find the same way as an edge that was sampled by chance and ends on
    /// the aim; `None` if the connection finds another way, or none.
    pub fn matching(
        scene: &Scene,
        vertex: &Vertex,
        edge: &Edge,
        aim: &Aim,
        ws: &mut Workspace,
    ) -> Option<Link> {
        let direction = edge.start.direction;
        if edge.straight {
            return Some(Link::straight(edge, aim));
        }
        let link = match *aim {
            Aim::Point { position, surface } => {
                to_point(scene, vertex, position, surface.map(|s| s.1), ws)?
            }
            Aim::Plane {
                through, direction, ..
            } => to_plane(scene, vertex, (through, direction), None, ws)?,
        };
        same_way(scene, link.direction, direction).then_some(link)
    }

    /// The connection along a straight edge, which is unique.
    fn straight(edge: &Edge, aim: &Aim) -> Link {
        let direction = edge.start.direction;
        let (origin, density) = match *aim {
            Aim::Point { position, surface } => {
                let cos = surface.map_or(1.0, |(_, normal)| normal.dot(-direction));
                (position, edge.length * edge.length / cos)
            }
            Aim::Plane { through, .. } => (through, 1.0),
        };
        Link {
            direction,
            origin,
            emission: -direction,
            depth: edge.depth,
            factor: edge.weight,
            choice: 1.0,
            events: 0,
            sigma: edge.length,
            miss: 0.0,
            geometry: 1.0 / density,
            density,
        }
    }

    /// Whether two links to one beam are the same ray.
    fn is_branch_of(&self, scene: &Scene, other: &Link) -> bool {
        same_way(scene, self.direction, other.direction)
            && (self.sigma / other.sigma - 1.0).abs() < same_angle(scene)
    }

    /// Transmittance, the factor of the interfaces included.
    pub fn transmittance(&self) -> Spectrum {
        self.depth.exp_neg() * self.factor
    }
}

fn same_angle(scene: &Scene) -> f64 {
    SAME_WAY.0.max(SAME_WAY.1 * scene.tolerance().get())
}

fn same_way(scene: &Scene, a: DVec3, b: DVec3) -> bool {
    a.distance(b) < same_angle(scene)
}

fn to_point(
    scene: &Scene,
    vertex: &Vertex,
    y: DVec3,
    normal: Option<DVec3>,
    ws: &mut Workspace,
) -> Option<Link> {
    let x = vertex.position();
    let start = vertex.start(scene, y - x);
    let target = match normal {
        Some(normal) => super::walk::leave(scene, y, normal, normal),
        None => y,
    };
    let outcome = ws.solver.connect(scene, (start.x, start.medium), target);
    ws.stats.connections.count(&outcome);
    let ray = outcome.ok()?;
    if !vertex.same_side(ray.direction_out, start.direction) {
        ws.stats.connections.discarded += 1;
        return None;
    }
    let pieces = ws.solver.pieces();
    let passage = Passage::new(scene, pieces, true);
    let n = scene.n(pieces.last()?.region, target);
    let cos = normal.map_or(1.0, |normal| normal.dot(-ray.direction_in));
    Some(Link {
        direction: ray.direction_out,
        origin: y,
        emission: -ray.direction_in,
        depth: passage.depth,
        factor: passage.factor,
        choice: passage.choice,
        events: passage.events,
        sigma: ray.sigma,
        miss: ray.miss,
        geometry: 1.0 / (ray.jacobian * n * n),
        density: ray.jacobian / cos.max(1e-300),
    })
}

/// From the plane through a point across a direction, started at the foot of the vertex or where a guide
/// says.
fn to_plane(
    scene: &Scene,
    vertex: &Vertex,
    (through, direction): (DVec3, DVec3),
    guided: Option<Start<MediumId>>,
    ws: &mut Workspace,
) -> Option<Link> {
    let start = vertex.start(scene, -direction);
    let plane = (through, direction, scene.medium_at(through));
    let outcome = match guided {
        None => ws.solver.connect_plane(scene, plane, start.x),
        Some(guided) => ws.solver.solve(scene, &guided, start.x),
    };
    ws.stats.connections.count(&outcome);
    let ray: Connection = outcome.ok()?;
    let arrives = ray.sigma > 0.0 && vertex.same_side(-ray.direction_in, start.direction);
    let pieces = ws.solver.pieces();
    if !arrives || pieces.last()?.region != start.medium {
        ws.stats.connections.discarded += 1;
        return None;
    }
    let passage = Passage::new(scene, pieces, false);
    let (n_x, n_e) = (scene.n(start.medium, start.x), scene.n(plane.2, ray.start));
    Some(Link {
        direction: -ray.direction_in,
        origin: ray.start,
        emission: direction,
        depth: passage.depth,
        factor: passage.factor,
        choice: passage.choice,
        events: passage.events,
        sigma: ray.sigma,
        miss: ray.miss,
        geometry: 1.0 / (ray.jacobian * n_x * n_x),
        density: ray.jacobian * (n_x / n_e).powi(2) * pass_factor(pieces),
    })
}

/// Share of the power in a ray tube that gets through the media and interfaces along it.
pub fn transmittance(scene: &Scene, pieces: &[Piece<MediumId>]) -> Spectrum {
    let passage = Passage::new(scene, pieces, false);
    passage.depth.exp_neg() * passage.factor
}

/// What happens to the light of a connection on its way.
struct Passage {
    depth: Spectrum,
    factor: Spectrum,
    choice: f64,
    events: u32,
}

impl Passage {
    /// Along the pieces of a ray; `backwards` if the ray runs against the light.
    fn new(scene: &Scene, pieces: &[Piece<MediumId>], backwards: bool) -> Self {
        let mut passage = Passage {
            depth: Spectrum::ZERO,
            factor: Spectrum::ONE,
            choice: 1.0,
            events: 0,
        };
        for piece in pieces {
            let medium = scene.medium(piece.region);
            let attenuation = Attenuation::new(medium, &piece.arc, piece.theta_end);
            passage.depth += attenuation.depth(&piece.arc, piece.theta_end);
            if let Some(event) = &piece.event {
                passage.cross(scene, event, backwards);
            }
        }
        passage
    }

    fn cross(&mut self, scene: &Scene, event: &Event, backwards: bool) {
        match &scene.objects()[event.surface].bsdf {
            Bsdf::Dielectric(dielectric) => {
                let (factor, probability) = dielectric.passage(
                    event.normal.dot(event.before).abs() / event.before.length(),
                    event.before.length(),
                    (event.rule == Rule::Refract).then(|| event.after.length()),
                );
                self.factor *= factor * probability;
                self.choice *= probability;
                self.events += 1;
            }
            // Across a declared index match L, not L/n², is conserved. 1/J has no part of it when
            // the ray runs against the light; 1/A has all of it when it runs along.
            _ if backwards => {
                self.factor *= event.after.length_squared() / event.before.length_squared();
            }
            _ => {}
        }
    }
}

/// ∏ n²/n'² over declared index matches, along the light: these jumps do not conserve étendue as
/// refraction does.
fn pass_factor(pieces: &[Piece<MediumId>]) -> f64 {
    pieces
        .iter()
        .filter_map(|p| p.event)
        .filter(|e| e.rule == Rule::Pass)
        .map(|e| e.before.length_squared() / e.after.length_squared())
        .product()
}

/// The aim with which a connection to an environment would look in the direction `toward`.
pub fn environment_aim(scene: &Scene, toward: DVec3) -> Aim {
    let around = scene.around();
    Aim::Plane {
        through: around.center + toward * (2.0 * around.radius),
        direction: -toward,
        beam: false,
    }
}
