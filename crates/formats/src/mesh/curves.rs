//! Curves with a thickness, as triangles: tubes along cubic B-splines, and balls that are swept along lines.
//!
//! Sides of tubes are polygons whose mean width is that of the circle. Normals are those of the curves. Circles of tubes are off by at most 0.6 % of the
//! radius and those of balls by 1.5 %; by 10 % and 20 % if there are many pieces.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use glam::{DAffine3, DVec3};

use super::MeshData;
use crate::error::{FileError, Problem};
use crate::input::{self, Limits};

/// A point that a curve follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlPoint {
    /// Where it is.
    pub position: DVec3,
    /// Radius of the tube, ≥ 0.
    pub radius: f64,
}

/// Into how many triangles a piece of a curve is cut.
#[derive(Clone, Copy)]
struct Fineness {
    /// Around a tube.
    sides: usize,
    /// Along a piece of a spline, and from a pole of a ball to the other.
    steps: usize,
}

impl Fineness {
    const FINE: Self = Fineness {
        sides: 24,
        steps: 12,
    };
    const COARSE: Self = Fineness { sides: 6, steps: 4 };

    /// That for so many pieces.
    fn of(pieces: usize) -> Self {
        if pieces <= MOST_FINE {
            Self::FINE
        } else {
            Self::COARSE
        }
    }

    /// Circumradius of a polygon over the radius of a circle of the same mean width.
    fn circumradius(self) -> f64 {
        let half = PI / self.sides as f64;
        half / half.sin()
    }
}

/// Pieces of curves of which there are more are coarse.
const MOST_FINE: usize = 10_000;
/// Bytes that a control point takes at most while its piece is made.
const POINT: u64 = 2_000;
/// Points that a piece of each kind takes.
const SPLINE: usize = 4;
const LINE: usize = 2;

/// Reads curves: a control point in each line, x, y, z and radius; empty lines between curves.
///
/// # Errors
///
/// A file that cannot be read or has no points, and, with their line, numbers that are none, not finite, or a radius
/// below 0.
pub fn read(path: &Path, limits: Limits) -> Result<Vec<Vec<ControlPoint>>, FileError> {
    let bytes = input::read(path)?;
    parse(&bytes, limits).map_err(|(problem, line)| FileError {
        path: path.to_owned(),
        line,
        problem,
    })
}

/// Reads curves from the bytes of a file. The error comes with its line.
///
/// # Errors
///
/// As for [`read`].
pub fn parse(
    bytes: &[u8],
    limits: Limits,
) -> Result<Vec<Vec<ControlPoint>>, (Problem, Option<usize>)> {
    let text = String::from_utf8_lossy(bytes);
    let most = limits.most(bytes.len() as u64) / POINT;
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

/// Curves elsewhere: transforms move control points and leave radii as they are.
pub fn moved(mut curves: Vec<Vec<ControlPoint>>, map: DAffine3) -> Vec<Vec<ControlPoint>> {
    for point in curves.iter_mut().flatten() {
        point.position = map.transform_point3(point.position);
    }
    curves
}

/// Open tubes along uniform cubic B-splines. u runs around, v along all curves, one after the other.
///
/// # Errors
///
/// If a curve has fewer than four points.
pub fn splines(curves: &[Vec<ControlPoint>]) -> Result<MeshData, Problem> {
    check(curves, SPLINE)?;
    let fineness = Fineness::of(pieces(curves, SPLINE));
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        normals: Some(Vec::new()),
        ..MeshData::default()
    };
    let (mut done, total) = (0, pieces(curves, SPLINE) as f64);
    for curve in curves {
        let pieces = curve.len() + 1 - SPLINE;
        let stops = pieces * fineness.steps;
        let mut side = None;
        let rings = (0..=stops).map(|k| {
            let piece = (k / fineness.steps).min(pieces - 1);
            let t = k as f64 / fineness.steps as f64 - piece as f64;
            let (point, tangent, taper) = on_spline(&curve[piece..piece + SPLINE], t);
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

/// Balls that are swept along lines between control points.
///
/// # Errors
///
/// If a curve has fewer than two points.
pub fn lines(curves: &[Vec<ControlPoint>]) -> Result<MeshData, Problem> {
    check(curves, LINE)?;
    let fineness = Fineness::of(pieces(curves, LINE));
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        normals: Some(Vec::new()),
        ..MeshData::default()
    };
    let total = pieces(curves, LINE) as f64;
    let lines = curves.iter().flat_map(|curve| curve.windows(LINE));
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

/// The point of a piece at t in [0, 1], the unit tangent, and the growth of the radius per length.
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

/// A unit vector across the tangent, near the one before.
fn across(tangent: DVec3, before: Option<DVec3>) -> DVec3 {
    let carried = before.and_then(|v| (v - tangent * v.dot(tangent)).try_normalize());
    carried.unwrap_or_else(|| tangent.any_orthonormal_vector())
}

/// A circle of a surface.
struct Ring {
    center: DVec3,
    /// Of the corners of the polygon that stands for it.
    radius: f64,
    /// Unit vectors in its plane, which with the direction along the tube are right-handed.
    axes: [DVec3; 2],
    /// Components of the surface's normal away from the centre and along the tube.
    normal: [f64; 2],
    v: f64,
}

/// A ball at two places and all between: the hull of two balls, which a cone touches.
fn swept([a, b]: [ControlPoint; 2], v: [f64; 2], mesh: &mut MeshData, fineness: Fineness) {
    let along = b.position - a.position;
    let length = along.length();
    let axis = along.try_normalize().unwrap_or(DVec3::Z);
    // Sine of the latitude at which the cone touches both; one ball holds the other if there is none.
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

/// Joins rings, in the order in which they lie along a tube.
fn tube(mesh: &mut MeshData, rings: Vec<Ring>, fineness: Fineness) {
    let first = mesh.positions.len() as u32;
    // The last corner of a ring is the first again, with another u.
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
