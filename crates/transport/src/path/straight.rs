//! Connections where no ray is bent: along the straight line, in closed form.

use crate::scene::{MediumId, Scene};
use eikonal::connect::{Connection, Event, Failure, Launch, Pattern, Piece, Start, World};
use eikonal::interface::Rule;
use eikonal::ray::Arc;
use glam::DVec3;

/// More index-matched boundaries than any sensible line crosses.
const MOST_CROSSINGS: usize = 20_000;

/// The ray that [`eikonal::Solver`] would find from a start to `target` in a scene that is straight, and its
/// pieces: J is the squared distance from a point, and A is 1 from a plane (theory §5).
///
/// # Errors
/// [`Failure::NotConverged`] if the ends coincide or the target lies behind the plane,
/// [`Failure::RayLost`] if too many boundaries lie between them.
pub(super) fn connect(
    scene: &Scene,
    start: &Start<MediumId>,
    target: DVec3,
    pieces: &mut Vec<Piece<MediumId>>,
) -> Result<Connection, Failure> {
    let chord = target - start.launch.x();
    let (direction, length, jacobian) = match start.launch {
        Launch::Point { .. } => {
            let length = chord.length();
            (chord / length, length, length * length)
        }
        Launch::Plane { direction, .. } => (direction, chord.dot(direction), 1.0),
    };
    if !(length > 0.0 && length.is_finite()) {
        return Err(Failure::NotConverged);
    }
    let first = target - direction * length;
    let (optical_length, sigma) = fill(scene, (first, start.region), (target, direction), pieces)?;
    Ok(Connection {
        start: first,
        direction_out: direction,
        direction_in: direction,
        arc_length: length,
        optical_length,
        sigma,
        jacobian,
        miss: 0.0,
        pattern: Pattern::REFRACT,
        shots: 0,
    })
}

/// Cuts the line at the boundaries that it crosses. Returns ∫n ds and ∫ds/n.
fn fill(
    scene: &Scene,
    (mut x, mut region): (DVec3, MediumId),
    (target, direction): (DVec3, DVec3),
    pieces: &mut Vec<Piece<MediumId>>,
) -> Result<(f64, f64), Failure> {
    pieces.clear();
    let (mut optical_length, mut sigma) = (0.0, 0.0);
    while pieces.len() < MOST_CROSSINGS {
        let n = scene.n(region, x);
        // The target may lie nearer to the last boundary than the nudge: the arc must still have a direction.
        let left = (target - x).dot(direction).max(scene.nudge());
        let arc = Arc::line(x, direction * n, left / n);
        let crossing = scene.crossing(region, &arc);
        let theta_end = crossing.as_ref().map_or(1.0, |c| c.theta);
        optical_length += left * theta_end * n;
        sigma += left * theta_end / n;
        let mut piece = Piece {
            region,
            arc,
            theta_end,
            event: None,
        };
        let Some(crossing) = crossing else {
            pieces.push(piece);
            return Ok((optical_length, sigma));
        };
        let far_n = scene.n(crossing.beyond, crossing.position);
        piece.event = Some(Event {
            rule: Rule::Pass,
            far_n,
            surface: crossing.surface,
            normal: crossing.normal,
            before: direction * n,
            after: direction * far_n,
        });
        pieces.push(piece);
        let side = crossing.normal.dot(direction);
        x = crossing.position + crossing.normal * scene.nudge().copysign(side);
        region = crossing.beyond;
    }
    Err(Failure::RayLost)
}
