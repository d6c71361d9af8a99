//! Edges made by connection: from a vertex to an emitter.

use super::Workspace;
use super::vertex::Vertex;
use crate::Spectrum;
use crate::bsdf::{Bsdf, Surface};
use crate::emitter::Aim;
use crate::medium::Attenuation;
use crate::scene::{AMBIENT, MediumId, Scene};
use eikonal::connect::{Connection, Event, Piece};
use eikonal::interface::Rule;
use glam::DVec3;

/// A ray between a vertex and an emitter, seen from the vertex.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Unit direction at the vertex, towards the light.
    pub direction: DVec3,
    /// Where the light starts.
    pub origin: DVec3,
    /// Unit direction in which the light leaves the emitter.
    pub emission: DVec3,
    /// Transmittance, Fresnel factors included.
    pub transmittance: Spectrum,
    /// 1/(J n_e²) for a point, 1/(A n_x²) for a plane (theory §3): turns what is emitted into what
    /// a basic-radiance vertex receives.
    pub geometry: f64,
    /// Density per steradian at the vertex of a unit density on the emitter: J/cos θ for a point on a
    /// surface, A n_x²/n_e² for a plane.
    pub density: f64,
    /// Arc length.
    pub length: f64,
}

impl Link {
    /// Connects a vertex to an emitter by the primary branch; `None` if there is none, or if it is
    /// blocked. Every attempt and its outcome is counted.
    pub fn new(scene: &Scene, vertex: &Vertex, aim: &Aim, ws: &mut Workspace) -> Option<Link> {
        let (link, target) = match *aim {
            Aim::Point { position, surface } => {
                let link = to_point(scene, vertex, position, surface.map(|s| s.1), ws)?;
                (link, surface.map(|s| s.0))
            }
            Aim::Plane { through, direction } => {
                let link = to_plane(scene, vertex, through, direction, ws)?;
                (link, vertex.object())
            }
        };
        if scene.is_occluded(ws.solver.pieces(), target) {
            ws.stats.connections.occluded += 1;
            return None;
        }
        Some(link)
    }
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
        return None;
    }
    let pieces = ws.solver.pieces();
    let end = pieces.last()?;
    let n = scene.n(end.region, target);
    let cos = normal.map_or(1.0, |normal| normal.dot(-ray.direction_in));
    Some(Link {
        direction: ray.direction_out,
        origin: y,
        emission: -ray.direction_in,
        transmittance: transmittance(scene, pieces, true),
        geometry: 1.0 / (ray.jacobian * n * n),
        density: ray.jacobian / cos.max(1e-300),
        length: ray.arc_length,
    })
}

fn to_plane(
    scene: &Scene,
    vertex: &Vertex,
    through: DVec3,
    direction: DVec3,
    ws: &mut Workspace,
) -> Option<Link> {
    let start = vertex.start(scene, -direction);
    let plane = (through, direction, scene.medium_at(through));
    let outcome = ws.solver.connect_plane(scene, plane, start.x);
    ws.stats.connections.count(&outcome);
    let ray: Connection = outcome.ok()?;
    if !vertex.same_side(-ray.direction_in, start.direction) {
        return None;
    }
    let pieces = ws.solver.pieces();
    if pieces.last()?.region != start.medium {
        return None;
    }
    let (n_x, n_e) = (
        scene.n(start.medium, start.x),
        scene.n(plane.2, ray.start),
    );
    Some(Link {
        direction: -ray.direction_in,
        origin: ray.start,
        emission: direction,
        transmittance: transmittance(scene, pieces, false),
        geometry: 1.0 / (ray.jacobian * n_x * n_x),
        density: ray.jacobian * (n_x / n_e).powi(2) * pass_factor(pieces),
        length: ray.arc_length,
    })
}

/// Attenuation and Fresnel factors along a ray. `backwards` if the ray runs against the light.
fn transmittance(scene: &Scene, pieces: &[Piece<MediumId>], backwards: bool) -> Spectrum {
    let mut depth = Spectrum::ZERO;
    let mut factor = Spectrum::ONE;
    for piece in pieces {
        let medium = scene.medium(piece.region);
        let attenuation = Attenuation::new(medium, &piece.arc, piece.theta_end);
        depth += attenuation.depth(&piece.arc, piece.theta_end);
        if let Some(event) = &piece.event {
            factor *= event_factor(scene, event, backwards);
        }
    }
    depth.exp_neg() * factor
}

/// Basic radiance that an interface lets through.
fn event_factor(scene: &Scene, event: &Event, backwards: bool) -> Spectrum {
    match &scene.objects()[event.surface].bsdf {
        // Across a declared index match L, not L/n², is conserved. 1/J has no part of it when the
        // ray runs against the light; 1/A has all of it when it runs along.
        Bsdf::Null(_) if backwards => {
            Spectrum::splat(event.after.length_squared() / event.before.length_squared())
        }
        Bsdf::Dielectric(dielectric) => {
            let (near, far) = (event.before.length(), event.after.length());
            let outward = event.normal.dot(event.before) > 0.0;
            let (n_inner, n_outer) = match (event.rule, outward) {
                (Rule::Refract, true) => (near, far),
                (Rule::Refract, false) => (far, near),
                _ => return dielectric.total_reflection(),
            };
            let surface = Surface {
                normal: event.normal,
                n_outer,
                n_inner,
            };
            dielectric.transmission(&surface, event.before.normalize())
        }
        _ => Spectrum::ONE,
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
pub(super) fn environment_aim(scene: &Scene, toward: DVec3) -> Aim {
    let around = scene.around();
    debug_assert_eq!(AMBIENT, 0);
    Aim::Plane {
        through: around.center + toward * (2.0 * around.radius),
        direction: -toward,
    }
}
