//! Newton's method on the shot.

use super::launch::Launch;
use super::shoot::{Landing, Piece, World, shoot};
use crate::ray::{Tolerance, Work};
use glam::{DMat3, DVec2, DVec3};

/// A ray between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connection {
    /// Start of the ray; the point asked for, or the point of the plane that was found.
    pub start: DVec3,
    /// Unit direction in which the ray leaves its start.
    pub direction_out: DVec3,
    /// Unit direction in which it arrives at the target.
    pub direction_in: DVec3,
    /// Geometric arc length.
    pub arc_length: f64,
    /// Optical path length ∫n ds.
    pub optical_length: f64,
    /// Span of σ = ∫ds/n.
    pub sigma: f64,
    /// Ray-tube cross section at the target: J = dA⊥/dΩ for a point launch, A = dA⊥/dA for a plane.
    pub jacobian: f64,
    /// How far from the target the ray passes for which the lengths and the Jacobian hold.
    pub miss: f64,
    /// Rays shot.
    pub shots: u32,
}

/// Why there is no connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The two points coincide.
    #[error("the two points coincide")]
    Coincident,
    /// Newton's method did not converge within its budget of shots.
    #[error("the iteration did not converge")]
    NotConverged,
    /// A shot left every region's field, or went on for too long.
    #[error("a ray left the field or went on for too long")]
    RayLost,
    /// The target lies on a caustic: the ray tube has no cross section there.
    #[error("the target lies on a caustic")]
    Caustic,
}

/// Budget of shots for one connection.
const MOST_SHOTS: u32 = 20;
/// Damping beyond which the iteration has come to a local minimum of the miss.
const STUCK: f64 = 1e3;

/// Finds connections; holds the storage that they reuse.
#[derive(Clone, Debug)]
pub struct Solver<R> {
    tolerance: Tolerance,
    pieces: Vec<Piece<R>>,
    /// Work done so far.
    pub work: Work,
}

impl<R: Copy + PartialEq + std::fmt::Debug> Solver<R> {
    /// A solver that accepts a ray when it passes the target within `tolerance` times the length of
    /// its last leg (from the last interface, or from the start), and corrects directions and lengths
    /// to first order for what remains.
    pub fn new(tolerance: Tolerance) -> Self {
        Solver {
            tolerance,
            pieces: Vec::new(),
            work: Work::default(),
        }
    }

    /// The pieces of the ray that was last found, in order.
    pub fn pieces(&self) -> &[Piece<R>] {
        &self.pieces
    }

    /// The primary branch from point `x` in `region` to `y`: started in the direction of the chord.
    pub fn connect<W: World<Region = R>>(
        &mut self,
        world: &W,
        (x, region): (DVec3, R),
        y: DVec3,
    ) -> Result<Connection, Failure> {
        let d = y - x;
        let launch = Launch::Point {
            x,
            direction: d.try_normalize().ok_or(Failure::Coincident)?,
        };
        let length = d.length() * world.field(region).n(x);
        self.solve(world, (launch, region), length, y)
    }

    /// The primary branch from the plane through `x` perpendicular to `direction` to `y`: started at
    /// the foot of `y` on the plane.
    pub fn connect_plane<W: World<Region = R>>(
        &mut self,
        world: &W,
        (x, direction, region): (DVec3, DVec3, R),
        y: DVec3,
    ) -> Result<Connection, Failure> {
        let depth = (y - x).dot(direction);
        let foot = y - direction * depth;
        let launch = Launch::Plane { x: foot, direction };
        let length = depth * world.field(region).n(foot);
        if length > 0.0 {
            self.solve(world, (launch, region), length, y)
        } else {
            Err(Failure::Coincident)
        }
    }

    /// The branch to which Newton's method converges from a given launch and optical path length.
    ///
    /// The unknowns are the launch's two parameters and the optical path length ℓ, the residual is
    /// x(ℓ) − y; steps that do not reduce it are shortened in the manner of Levenberg and Marquardt.
    /// With ℓ rather than σ the family's points at equal parameter form a wavefront, which near a focus
    /// closes in on it from one side.
    pub fn solve<W: World<Region = R>>(
        &mut self,
        world: &W,
        (launch, region): (Launch, R),
        optical_length: f64,
        y: DVec3,
    ) -> Result<Connection, Failure> {
        let distance = launch.x().distance(y);
        // Positions are no better than round-off, nor than the distance by which rays are kept off
        // interfaces.
        let floor = 1e-13 * (distance + y.length()) + 10.0 * world.nudge();
        let mut trial = Iterate {
            launch,
            length: optical_length,
        };
        let mut best: Option<(Iterate, Landing, f64)> = None;
        let mut damping = 0.0;
        for shots in 1..=MOST_SHOTS {
            if damping > STUCK {
                break;
            }
            let landing = self.shot(world, &trial, region);
            let miss = landing.map_or(f64::INFINITY, |l| l.x.distance(y));
            match (&best, landing) {
                (_, Ok(landing)) if miss <= self.goal(floor) => {
                    return self.finish(&trial, &landing, y, shots);
                }
                (None, Err(failure)) => return Err(failure),
                (Some((_, _, least)), _) if miss.is_nan() || miss >= *least => {
                    damping = f64::max(damping * 8.0, 0.05);
                }
                (_, Ok(landing)) => {
                    best = Some((trial, landing, miss));
                    damping = if damping > 0.02 { damping / 16.0 } else { 0.0 };
                }
                (_, Err(failure)) => return Err(failure),
            }
            let Some((iterate, landing, _)) = &best else {
                return Err(Failure::NotConverged);
            };
            trial = iterate.stepped(landing, y, damping, distance)?;
        }
        Err(Failure::NotConverged)
    }

    /// How close to the target a ray must pass: on the scale of its length since the last interface,
    /// since a target just behind a wall that is lit from far away must be met on the scale of its
    /// distance to the wall.
    fn goal(&self, floor: f64) -> f64 {
        let last = self.pieces.iter().rev().enumerate();
        let leg: f64 = last
            .take_while(|(i, piece)| *i == 0 || piece.event.is_none())
            .map(|(_, piece)| piece.arc.arc_length(piece.theta_end))
            .sum();
        f64::max(self.tolerance.get() * leg, floor)
    }

    fn shot<W: World<Region = R>>(
        &mut self,
        world: &W,
        iterate: &Iterate,
        region: R,
    ) -> Result<Landing, Failure> {
        let node = iterate.launch.node(world.field(region));
        shoot(
            world,
            (node, region),
            iterate.length,
            self.tolerance,
            &mut self.pieces,
            &mut self.work,
        )
    }

    /// The accepted ray, corrected to first order for its remaining miss.
    fn finish(
        &self,
        iterate: &Iterate,
        landing: &Landing,
        y: DVec3,
        shots: u32,
    ) -> Result<Connection, Failure> {
        let miss = y - landing.x;
        let step = system(landing).inverse() * miss;
        let jacobian = landing.tangents.cross_section(landing.v).abs();
        if !(step.is_finite() && jacobian > 0.0) {
            return Err(Failure::Caustic);
        }
        let launch = iterate.launch.moved(step.truncate());
        // The end moves sideways by the tangents at equal σ and along the ray by what is left of the miss.
        let at_equal_sigma = landing.tangents.dx[0] * step.x + landing.tangents.dx[1] * step.y;
        let shift = landing.v.dot(miss - at_equal_sigma) / landing.v.length_squared();
        let dv =
            landing.tangents.dv[0] * step.x + landing.tangents.dv[1] * step.y + landing.a * shift;
        let along = landing.v.dot(miss);
        let n = landing.v.length();
        let sum = |f: &dyn Fn(&Piece<R>) -> f64| self.pieces.iter().map(f).sum::<f64>();
        Ok(Connection {
            start: launch.x(),
            direction_out: launch.direction(),
            direction_in: (landing.v + dv).normalize(),
            arc_length: sum(&|p| p.arc.arc_length(p.theta_end)) + along / n,
            optical_length: sum(&|p| p.arc.optical_length(p.theta_end)) + along,
            sigma: sum(&|p| p.arc.h() * p.theta_end) + along / (n * n),
            jacobian,
            miss: miss.length(),
            shots,
        })
    }
}

#[derive(Clone, Copy, Debug)]
struct Iterate {
    launch: Launch,
    length: f64,
}

impl Iterate {
    /// The next iterate: Newton's step, damped and capped.
    fn stepped(
        &self,
        landing: &Landing,
        y: DVec3,
        damping: f64,
        distance: f64,
    ) -> Result<Iterate, Failure> {
        let matrix = system(landing);
        let miss = y - landing.x;
        let normal = matrix.transpose() * matrix;
        let scale = normal.diagonal();
        let step = if damping == 0.0
            && matrix.determinant().abs() > 1e-12 * scale.element_product().sqrt()
        {
            matrix.inverse() * miss
        } else {
            // At least a trace of damping: near a caustic the plain system is singular.
            let damped = normal + DMat3::from_diagonal(scale * f64::max(damping, 1e-8));
            damped.inverse() * (matrix.transpose() * miss)
        };
        if !step.is_finite() {
            return Err(Failure::Caustic);
        }
        let sideways: DVec2 = step.truncate();
        let cap = self.launch.longest_step(distance);
        let shrink = (cap / sideways.length().max(1e-300)).min(1.0);
        Ok(Iterate {
            launch: self.launch.moved(sideways * shrink),
            length: self.length + (step.z * shrink).clamp(-0.5 * self.length, self.length),
        })
    }
}

/// Derivative of the end of the ray with respect to the launch's parameters and the optical path
/// length: at equal optical length the tangents are perpendicular to the ray (Malus and Dupin).
fn system(landing: &Landing) -> DMat3 {
    let n2 = landing.v.length_squared();
    let across = |dx: DVec3| dx - landing.v * (landing.v.dot(dx) / n2);
    let [a, b] = landing.tangents.dx.map(across);
    DMat3::from_cols(a, b, landing.v / n2)
}
