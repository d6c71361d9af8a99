//! Curved rays through a scene.

use super::scene::target;
use super::{Failure, bad, json_response, not_found};
use crate::server::Response;
use glam::DVec3;
use io::Loaded;
use serde::Deserialize;
use serde_json::{Value, json};
use transport::trace::{Branch, Path, TraceEnding, Tracer, branches};

/// Distance of the start of a connection from a surface, relative to the length of the ray. The
/// connection then leaves the surface on the side of arrival.
const START_DISTANCE: f64 = 1e-6;
/// Maximum number of reflections of branches.
const MAX_REFLECTIONS: u32 = 4;

/// Ray to trace: through the centre of a pixel, or from a point in a direction of any length.
#[derive(Deserialize)]
#[serde(untagged)]
enum RayRequest {
    Pixel { pixel: [usize; 2] },
    Free { from: [f64; 3], direction: [f64; 3] },
}

/// Request to find rays from a start to a point or an emitter. The start is a point, or lies on the
/// ray of a pixel: at its end, or at an arc length.
#[derive(Deserialize)]
struct ConnectRequest {
    from: Option<[f64; 3]>,
    pixel: Option<[usize; 2]>,
    at: Option<f64>,
    to: Option<[f64; 3]>,
    emitter: Option<usize>,
    #[serde(default)]
    reflections: u32,
}

fn parse<'a, T: Deserialize<'a>>(body: &'a Value) -> Result<T, Failure> {
    T::deserialize(body).map_err(bad)
}

fn finite(x: [f64; 3]) -> Result<DVec3, Failure> {
    let x = DVec3::from_array(x);
    x.is_finite()
        .then_some(x)
        .ok_or_else(|| bad("numbers must be finite"))
}

/// Traces a ray to its end.
pub(super) fn trace(loaded: &Loaded, body: &Value) -> Result<Response, Failure> {
    let path = match parse(body)? {
        RayRequest::Pixel { pixel } => of_pixel(loaded, pixel)?,
        RayRequest::Free { from, direction } => {
            let direction = finite(direction)?.try_normalize();
            let direction = direction.ok_or_else(|| bad("the direction must not be zero"))?;
            follow(loaded, finite(from)?, direction)
        }
    };
    Ok(json_response(&describe(loaded, &path)))
}

/// Traces the ray through the centre of a pixel and of the lens.
fn of_pixel(loaded: &Loaded, [x, y]: [usize; 2]) -> Result<Path, Failure> {
    let scene = loaded.scene();
    let film = scene.film();
    if x >= film.width || y >= film.height {
        return Err(bad(format!(
            "pixel {x},{y} is not on the film, which has {} x {} pixels",
            film.width, film.height
        )));
    }
    let image = film.image([x as f64 + 0.5, y as f64 + 0.5]);
    let ray = scene.sensor().ray(image, [0.5; 2]);
    Ok(follow(loaded, ray.origin, ray.direction))
}

fn follow(loaded: &Loaded, from: DVec3, direction: DVec3) -> Path {
    let tracer = Tracer::new(loaded.scene(), None).with_reference(loaded.reference());
    tracer.follow(from, direction)
}

fn describe(loaded: &Loaded, path: &Path) -> Value {
    let scene = loaded.scene();
    let (end, surface) = match path.ending {
        TraceEnding::Surface(object) => ("surface", Some(scene.objects()[object].name.as_str())),
        TraceEnding::Left => ("left the scene", None),
        TraceEnding::Length => ("maximum length", None),
        TraceEnding::Lost => ("lost", None),
    };
    let last = path.points.last();
    json!({
        "end": end,
        "surface": surface,
        "arc_length": last.map(|p| p.arc_length),
        "optical_length": last.map(|p| p.optical_length),
        "points": path.points.iter().map(|p| p.x.to_array()).collect::<Vec<_>>(),
        "optical_lengths": path.points.iter().map(|p| p.optical_length).collect::<Vec<_>>(),
        "index": path.points.iter().map(|p| p.index).collect::<Vec<_>>(),
    })
}

/// Finds all branches between two points.
pub(super) fn connect(loaded: &Loaded, body: &Value) -> Result<Response, Failure> {
    let request: ConnectRequest = parse(body)?;
    if request.reflections > MAX_REFLECTIONS {
        return Err(bad(format!("at most {MAX_REFLECTIONS} reflections")));
    }
    let from = match (request.from, request.pixel) {
        (Some(from), None) => finite(from)?,
        (None, Some(pixel)) => {
            let path = of_pixel(loaded, pixel)?;
            match request.at {
                Some(length) => after(&path, length)?,
                None => before_end(&path)?,
            }
        }
        _ => return Err(bad("either 'from' or 'pixel' says where rays start")),
    };
    let to = match (request.to, request.emitter) {
        (Some(to), None) => finite(to)?,
        (None, Some(i)) => {
            target(loaded.scene(), i).ok_or_else(|| not_found("place of the emitter"))?
        }
        _ => return Err(bad("either 'to' or 'emitter' says where rays end")),
    };
    let found = branches(loaded.same_rays(), from, to, Some(request.reflections));
    Ok(json_response(&json!({
        "from": from.to_array(),
        "to": to.to_array(),
        "branches": found.list.iter().map(about_branch).collect::<Vec<_>>(),
        "certified_unique": found.is_unique,
        "failure": found.failure.map(|f| f.to_string()),
    })))
}

/// Returns the point of a ray at some arc length, on the chord between two of its points.
/// Connections may start at any point.
fn after(path: &Path, length: f64) -> Result<DVec3, Failure> {
    let found = path.points.windows(2).find(|pair| {
        let along = pair[0].arc_length..=pair[1].arc_length;
        along.contains(&length)
    });
    let pair = found.ok_or_else(|| bad("the ray of this pixel is shorter than 'at'"))?;
    let [a, b] = [&pair[0], &pair[1]];
    let share = (length - a.arc_length) / (b.arc_length - a.arc_length).max(f64::MIN_POSITIVE);
    Ok(a.x.lerp(b.x, share))
}

/// Returns a point just before the surface on which a ray ends.
fn before_end(path: &Path) -> Result<DVec3, Failure> {
    let (Some(last), TraceEnding::Surface(_)) = (path.points.last(), path.ending) else {
        return Err(bad(
            "the ray of this pixel does not end on a surface: say after which length along it rays start",
        ));
    };
    let back = path.points.iter().rev().find(|p| p.x != last.x);
    let back = back.map_or(DVec3::ZERO, |p| (p.x - last.x).normalize_or_zero());
    Ok(last.x + back * (START_DISTANCE * last.arc_length))
}

fn about_branch(branch: &Branch) -> Value {
    let ray = &branch.connection;
    json!({
        "points": branch.points.iter().map(|x| x.to_array()).collect::<Vec<_>>(),
        "arc_length": ray.arc_length,
        "optical_length": ray.optical_length,
        "jacobian": ray.jacobian,
        "transmittance": branch.transmittance,
        "reflections": ray.pattern.reflections(),
        "occluded": branch.is_occluded,
        "primary": branch.is_primary,
    })
}
