//! Check for media through which rays take very many steps, and for impossible indices, before
//! rendering.

use crate::diagnostic::lints;
use crate::schema::NumberRange;
use eikonal::budget::STEPS_PER_RAY;
use eikonal::ray::steps_between;
use eikonal::{Aabb, Field};
use glam::DVec3;
use transport::scene::{ProblemSeverity, Scene, SceneProblem, Subject};

/// Number of steps of a ray across a medium above which the scene is probably wrong. Lenses take
/// about ten steps.
const MAX_STEPS: f64 = 2000.0;
/// Largest ratio of the true and the estimated number of steps.
const MAX_ESTIMATE_RATIO: f64 = 2.0;
/// Number of bisections that locate the end of a cut line.
const BISECTIONS: usize = 30;
/// Number of intervals on each line through a medium, at whose ends the index is evaluated.
const PLACES: usize = 64;

/// Returns the approximate number of steps that a ray takes across a medium. It is the maximum over
/// lines along the three axes of the medium's box, and over lines that pass opaque objects there.
pub fn steps_across(scene: &Scene, medium: usize) -> f64 {
    let field = &scene.medium(medium).index;
    let steps = lines_within(scene, medium).map(|line| {
        let parts = parts_within(scene, medium, line).into_iter();
        let steps = parts.map(|part| steps_between(field, part, scene.tolerance()));
        steps.sum::<f64>()
    });
    steps.fold(1.0, f64::max)
}

/// Returns evenly spaced points on a line.
fn places([from, to]: [DVec3; 2]) -> impl Iterator<Item = DVec3> + Clone {
    (0..=PLACES).map(move |i| from.lerp(to, i as f64 / PLACES as f64))
}

/// Returns the parts of a line outside opaque objects; without such objects, the whole line.
fn parts_within(scene: &Scene, medium: usize, line: [DVec3; 2]) -> Vec<[DVec3; 2]> {
    let is_there = |x: DVec3| !scene.is_displaced(medium, x);
    let places: Vec<(DVec3, bool)> = places(line).map(|x| (x, is_there(x))).collect();
    let runs = places.chunk_by(|(_, a), (_, b)| a == b);
    let mut absent = None;
    let mut parts: Vec<[DVec3; 2]> = Vec::new();
    for run in runs {
        let [(first, there), (last, _)] = [run[0], run[run.len() - 1]];
        if there {
            let begin = absent.map_or(first, |absent| edge(first, absent, is_there));
            parts.push([begin, last]);
        } else {
            if let Some(part) = parts.last_mut() {
                part[1] = edge(part[1], first, is_there);
            }
            absent = Some(last);
        }
    }
    parts
}

/// Returns the last point inside the medium on the way from a point inside to a point outside.
fn edge(mut there: DVec3, mut absent: DVec3, is_there: impl Fn(DVec3) -> bool) -> DVec3 {
    for _ in 0..BISECTIONS {
        let middle = there.midpoint(absent);
        if is_there(middle) {
            there = middle;
        } else {
            absent = middle;
        }
    }
    there
}

/// Returns the straight lines along the axes through the centre of a medium.
fn lines_across(scene: &Scene, medium: usize) -> impl Iterator<Item = [DVec3; 2]> {
    let bounds = scene.regions()[medium].aabb;
    let axes = DVec3::AXES.into_iter().filter(move |_| !bounds.is_empty());
    axes.map(move |axis| through(&bounds, bounds.center(), axis))
}

/// Returns the line through a point along an axis, across a box.
fn through(bounds: &Aabb, x: DVec3, axis: DVec3) -> [DVec3; 2] {
    let across = DVec3::ONE - axis;
    [bounds.min, bounds.max].map(|end| x * across + end * axis)
}

/// Returns the lines along the axes through the centre. For each line that opaque objects cut, also
/// returns lines along the other axes through the middle of each remaining part, as along an
/// atmosphere.
fn lines_within(scene: &Scene, medium: usize) -> impl Iterator<Item = [DVec3; 2]> {
    let bounds = scene.regions()[medium].aabb;
    let beside = move |line: [DVec3; 2]| {
        let parts = parts_within(scene, medium, line);
        let is_cut = parts != [line];
        let middles = parts.into_iter().map(|[a, b]| a.midpoint(b));
        let middles: Vec<DVec3> = middles.filter(|_| is_cut).collect();
        let along = (line[1] - line[0]).normalize_or_zero();
        let others = DVec3::AXES
            .into_iter()
            .filter(move |axis| axis.dot(along) == 0.0);
        others.flat_map(move |axis| {
            middles
                .clone()
                .into_iter()
                .map(move |x| through(&bounds, x, axis))
        })
    };
    lines_across(scene, medium).chain(lines_across(scene, medium).flat_map(beside))
}

/// Returns a warning for each medium that needs very many steps, and an error for each medium with
/// an index outside the physical range.
pub(super) fn problems(scene: &Scene) -> Vec<SceneProblem> {
    let bent = |i: &usize| !scene.medium(*i).index.is_constant();
    let media = (0..scene.media().len()).filter(bent);
    media
        .filter_map(|i| out_of_range(scene, i).or_else(|| costly(scene, i)))
        .collect()
}

/// Returns a warning about a medium through which rays take very many steps.
fn costly(scene: &Scene, medium: usize) -> Option<SceneProblem> {
    let steps = steps_across(scene, medium);
    let name = &scene.medium(medium).name;
    let what = parameter(&scene.medium(medium).index);
    let fate = if MAX_ESTIMATE_RATIO * steps > STEPS_PER_RAY as f64 {
        format!("rays are given up after {STEPS_PER_RAY}, and their light is missing")
    } else {
        "the render takes very long".into()
    };
    let message = format!(
        "a ray across medium '{name}' takes about {steps:.0e} steps, while lenses need ten: {fate}"
    );
    let help = format!(
        "check {what} against the size of the medium; a larger 'tolerance' of the integrator takes fewer steps"
    );
    let subject = Subject::Medium(medium);
    (steps > MAX_STEPS).then(|| SceneProblem::warning(lints::MANY_STEPS, subject, message, help))
}

/// Returns the parameter that determines the length scale of a field.
fn parameter(field: &Field) -> &'static str {
    match field {
        Field::Bspline(_) | Field::SampledSound(_) => {
            "the spacing of its samples, and their noise,"
        }
        Field::Gaussian(_) => "its 'width'",
        Field::Acoustic(_) => "its 'wave_number', or 'frequency' and 'sound_speed',",
        Field::Fisheye(_) | Field::Luneburg(_) => "its 'radius'",
        Field::Selfoc(_) => "its 'alpha'",
        Field::LinearIndex(_) | Field::LinearSquare(_) => "its 'slope'",
        _ => "the fields of its index",
    }
}

/// Returns an error about a medium with an index outside the physical range.
fn out_of_range(scene: &Scene, medium: usize) -> Option<SceneProblem> {
    let field = &scene.medium(medium).index;
    let places = lines_across(scene, medium).flat_map(places);
    let places = places.filter(|x| !scene.is_displaced(medium, *x));
    // Skip indices that are not positive: another check reports them.
    let n = places
        .map(|x| field.n(x))
        .find(|n| *n > 0.0 && !NumberRange::INDEX.contains(*n))?;
    let name = &scene.medium(medium).name;
    Some(SceneProblem {
        severity: ProblemSeverity::Error,
        subject: Subject::Medium(medium),
        message: format!(
            "the index of medium '{name}' reaches {n:.1e}: no medium has an index outside of {}",
            NumberRange::INDEX
        ),
        help: format!("check {} against the size of the medium", parameter(field)),
    })
}
