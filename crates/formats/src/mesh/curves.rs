//! Curves with a thickness, as triangles: tubes along cubic B-splines, and balls swept along lines.
//!
//! Cross sections of tubes are polygons with the mean width of the circle. Normals belong to the
//! exact surfaces. Circles of tubes deviate by at most 0.6 % of the radius, and circles of balls by
//! 1.5 %; with many pieces, by 10 % and 20 %.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::MeshData;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// Control point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlPoint {
    /// Position of the point.
    pub position: DVec3,
    /// Radius of the tube, ≥ 0.
    pub radius: f64,
}

/// Numbers of triangles per piece of a curve.
#[derive(Clone, Copy)]
struct Fineness {
    /// Number of sides around a tube.
    sides: usize,
    /// Number of steps along a piece of a spline, and from pole to pole of a ball.
    steps: usize,
}

impl Fineness {
    const FINE: Self = Fineness {
        sides: 24,
        steps: 12,
    };
    const COARSE: Self = Fineness { sides: 6, steps: 4 };

    /// Returns the fineness for a number of pieces.
    fn of(pieces: usize) -> Self {
        if pieces <= MAX_FINE_PIECES {
            Self::FINE
        } else {
            Self::COARSE
        }
    }

    /// Returns the circumradius of a polygon, relative to the radius of a circle of equal mean
    /// width.
    fn circumradius(self) -> f64 {
        let half = PI / self.sides as f64;
        half / half.sin()
    }
}

/// Maximum number of pieces that are divided finely.
const MAX_FINE_PIECES: usize = 10_000;
/// Maximum memory per control point while the pieces of a curve are made, in bytes.
const BYTES_PER_POINT: u64 = 2_000;
/// Minimum number of control points of a spline; `MIN_LINE_POINTS` is the minimum for straight
/// pieces.
const MIN_SPLINE_POINTS: usize = 4;
const MIN_LINE_POINTS: usize = 2;

/// Reads curves: a control point per line, x, y, z and radius; empty lines separate curves.
///
/// # Errors
///
/// A file that cannot be read or has no points. With their line: numbers that are invalid or not
/// finite, or a radius below 0.
pub fn read(path: &Path, limits: Limits) -> Result<Vec<Vec<ControlPoint>>, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, limits).map_err(|(problem, line)| FileError {
        path: path.to_owned(),
        line,
        problem,
    })
}

/// Reads curves from the bytes of a file. Errors have a line number.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(
    bytes: &[u8],
    limits: Limits,
) -> Result<Vec<Vec<ControlPoint>>, (Problem, Option<usize>)> {
    let text = String::from_utf8_lossy(bytes);
    let most = limits.most(bytes.len() as u64) / BYTES_PER_POINT;
    let mut curves: Vec<Vec<ControlPoint>> = Vec::new();
    let (mut count, mut is_new) = (0, true);
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            is_new = true;
            continue;
        }
        let point = point(line).map_err(|problem| (problem, Some(index + 1)))?;
        count += 1;
        if count > most {
            let message = format!("more than {most} control points");
            return Err((Problem::Unsupported(message), Some(index + 1)));
        }
        if is_new {
            curves.push(Vec::new());
            is_new = false;
        }
        curves.last_mut().into_iter().for_each(|c| c.push(point));
    }
    if curves.is_empty() {
        return Err((Problem::Malformed("no control points".into()), None));
    }
    Ok(curves)
}

fn point(line: &str) -> Result<ControlPoint, Problem> {
    let numbers: Vec<f64> = line
        .split_whitespace()
        .take(4)
        .map_while(|word| word.parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    match numbers[..] {
        [x, y, z, radius] if radius >= 0.0 => Ok(ControlPoint {
            position: DVec3::new(x, y, z),
            radius,
        }),
        _ => {
            let message = "expected x, y, z and a radius ≥ 0, all finite";
            Err(Problem::Malformed(message.into()))
        }
    }
}

/// Transforms curves. Control points move, and radii do not change.
pub fn moved(mut curves: Vec<Vec<ControlPoint>>, map: DAffine3) -> Vec<Vec<ControlPoint>> {
    for point in curves.iter_mut().flatten() {
        point.position = map.transform_point3(point.position);
    }
    curves
}

/// Makes open tubes along uniform cubic B-splines. u runs around each tube, v along all curves in
/// sequence.
///
/// # Errors
///
/// A curve with fewer than four points.
pub fn splines(curves: &[Vec<ControlPoint>]) -> Result<MeshData, Problem> {
    check(curves, MIN_SPLINE_POINTS)?;
    let fineness = Fineness::of(pieces(curves, MIN_SPLINE_POINTS));
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        normals: Some(Vec::new()),
        ..MeshData::default()
    };
    let (mut done, total) = (0, pieces(curves, MIN_SPLINE_POINTS) as f64);
    for curve in curves {
        let pieces = curve.len() + 1 - MIN_SPLINE_POINTS;
        let stops = pieces * fineness.steps;
        let mut side = None;
        let rings = (0..=stops).map(|k| {
            let piece = (k / fineness.steps).min(pieces - 1);
            let t = k as f64 / fineness.steps as f64 - piece as f64;
            let (point, tangent, taper) = on_spline(&curve[piece..piece + MIN_SPLINE_POINTS], t);
            let across = across(tangent, side);
            side = Some(across);
            Ring {
                center: point.position,
                radius: point.radius * fineness.circumradius(),
                axes: [across, tangent.cross(across)],
                normal: [1.0, -taper],
                v: (done as f64 + k as f64 / fineness.steps as f64) / total,
            }
        });
        tube(&mut mesh, rings.collect(), fineness);
        done += pieces;
    }
    Ok(mesh)
}

/// Makes balls that are swept along lines between control points.
///
/// # Errors
///
/// A curve with fewer than two points.
pub fn lines(curves: &[Vec<ControlPoint>]) -> Result<MeshData, Problem> {
    check(curves, MIN_LINE_POINTS)?;
    let fineness = Fineness::of(pieces(curves, MIN_LINE_POINTS));
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        normals: Some(Vec::new()),
        ..MeshData::default()
    };
    let total = pieces(curves, MIN_LINE_POINTS) as f64;
    let lines = curves
        .iter()
        .flat_map(|curve| curve.windows(MIN_LINE_POINTS));
    for (k, ends) in lines.enumerate() {
        let v = [k, k + 1].map(|k| k as f64 / total);
        swept([ends[0], ends[1]], v, &mut mesh, fineness);
    }
    Ok(mesh)
}

fn check(curves: &[Vec<ControlPoint>], least: usize) -> Result<(), Problem> {
    let Some(short) = curves.iter().position(|c| c.len() < least) else {
        return Ok(());
    };
    let message = format!(
        "curve {} has {} control points; it takes {least} or more",
        short + 1,
        curves[short].len()
    );
    Err(Problem::Malformed(message))
}

fn pieces(curves: &[Vec<ControlPoint>], least: usize) -> usize {
    curves.iter().map(|c| c.len() + 1 - least).sum()
}

/// Returns the point of a piece at t in [0, 1], the unit tangent, and the growth of the radius per
/// length.
fn on_spline(points: &[ControlPoint], t: f64) -> (ControlPoint, DVec3, f64) {
    let s = 1.0 - t;
    let weights = [
        s * s * s / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
        t * t * t / 6.0,
    ];
    let slopes = [
        -0.5 * s * s,
        -2.0 * t + 1.5 * t * t,
        2.0 * s - 1.5 * s * s,
        0.5 * t * t,
    ];
    let sum = |weights: [f64; 4]| {
        let terms = points.iter().zip(weights);
        terms.fold(DVec3::ZERO, |sum, (p, w)| sum + p.position * w)
    };
    let radius = |weights: [f64; 4]| points.iter().zip(weights).map(|(p, w)| p.radius * w).sum();
    let (along, growth): (DVec3, f64) = (sum(slopes), radius(slopes));
    let taper = growth / along.length();
    (
        ControlPoint {
            position: sum(weights),
            radius: radius(weights),
        },
        along.try_normalize().unwrap_or(DVec3::Z),
        if taper.is_finite() { taper } else { 0.0 },
    )
}

/// Returns a unit vector perpendicular to the tangent, close to the previous one.
fn across(tangent: DVec3, before: Option<DVec3>) -> DVec3 {
    let carried = before.and_then(|v| (v - tangent * v.dot(tangent)).try_normalize());
    carried.unwrap_or_else(|| tangent.any_orthonormal_vector())
}

/// Circle on a surface.
struct Ring {
    center: DVec3,
    /// Radius of the corners of the polygon that approximates the circle.
    radius: f64,
    /// Unit vectors in the plane of the circle, right-handed with the direction along the tube.
    axes: [DVec3; 2],
    /// Components of the surface's normal away from the centre and along the tube.
    normal: [f64; 2],
    v: f64,
}

/// Makes the hull of two balls and all balls between them: two caps and the cone that touches the
/// balls.
fn swept([a, b]: [ControlPoint; 2], v: [f64; 2], mesh: &mut MeshData, fineness: Fineness) {
    let along = b.position - a.position;
    let length = along.length();
    let axis = along.try_normalize().unwrap_or(DVec3::Z);
    // Compute the sine of the latitude at which the cone touches both balls. Without one, one ball
    // contains the other.
    let sine = (a.radius - b.radius) / length;
    let touching = if sine.abs() < 1.0 {
        sine.asin()
    } else if a.radius > b.radius {
        FRAC_PI_2
    } else {
        -FRAC_PI_2
    };
    let across = axis.any_orthonormal_vector();
    let axes = [across, axis.cross(across)];
    let ring = |ball: &ControlPoint, latitude: f64, v: f64| Ring {
        center: ball.position + axis * (ball.radius * latitude.sin()),
        radius: if latitude.abs() < FRAC_PI_2 {
            ball.radius * latitude.cos() * fineness.circumradius()
        } else {
            0.0
        },
        axes,
        normal: [latitude.cos(), latitude.sin()],
        v,
    };
    let cap = |ball: ControlPoint, from: f64, to: f64, v: f64| {
        let count = (fineness.steps as f64 * (to - from) / PI).ceil() as usize;
        (0..=count).map(move |k| {
            let latitude = from + (to - from) * k as f64 / count.max(1) as f64;
            ring(&ball, latitude, v)
        })
    };
    let below = cap(a, -FRAC_PI_2, touching, v[0]).filter(|_| touching > -FRAC_PI_2);
    let above = cap(b, touching, FRAC_PI_2, v[1]).filter(|_| touching < FRAC_PI_2);
    tube(mesh, below.chain(above).collect(), fineness);
}

/// Connects rings, in their order along a tube.
fn tube(mesh: &mut MeshData, rings: Vec<Ring>, fineness: Fineness) {
    let first = mesh.positions.len() as u32;
    // Repeat the first corner of a ring at its end, with another u.
    let corners = fineness.sides as u32 + 1;
    for ring in &rings {
        let [away, along] = ring.normal;
        let lean = ring.axes[0].cross(ring.axes[1]) * along;
        for k in 0..corners {
            let u = f64::from(k) / fineness.sides as f64;
            let turn = if k + 1 == corners { 0.0 } else { TAU * u };
            let (sin, cos) = turn.sin_cos();
            let radial = ring.axes[0] * cos + ring.axes[1] * sin;
            mesh.positions.push(ring.center + radial * ring.radius);
            mesh.normals
                .iter_mut()
                .for_each(|all| all.push(radial * away + lean));
            mesh.uvs.iter_mut().for_each(|uvs| uvs.push([u, ring.v]));
        }
    }
    for ring in 0..(rings.len() as u32).saturating_sub(1) {
        for k in 0..corners - 1 {
            let here = first + ring * corners + k;
            let next = here + corners;
            mesh.triangles.push([here, here + 1, next + 1]);
            mesh.triangles.push([here, next + 1, next]);
        }
    }
}
