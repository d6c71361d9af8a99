//! Check for media that no light can enter. The cause is usually a shape without its `null` bsdf.

use crate::diagnostic::lints;
use transport::scene::{AMBIENT, MediumId, Scene, SceneProblem, Subject};

/// Returns a warning for each closed, opaque shape that keeps all light out of a medium.
pub(super) fn warnings(scene: &Scene) -> Vec<SceneProblem> {
    let lit = lit(scene);
    let mut warned = vec![false; scene.media().len()];
    let mut problems = Vec::new();
    for (i, object) in scene.objects().iter().enumerate() {
        let Some(medium) = object.interior() else {
            continue;
        };
        let shut = object.bsdf.is_opaque() && object.shape.is_closed() && !lit[medium];
        if shut && !std::mem::replace(&mut warned[medium], true) {
            problems.push(warning(i, &object.name, &scene.medium(medium).name));
        }
    }
    problems
}

/// Returns for each medium whether light can reach it. Light starts from the ambient medium and
/// from media with emitters or the sensor, and passes through every surface that is not opaque. The
/// sensor's viewing direction is ignored.
fn lit(scene: &Scene) -> Vec<bool> {
    let mut lit = vec![false; scene.media().len()];
    lit[AMBIENT] = true;
    for x in scene.sensor().positions() {
        lit[scene.medium_at(x)] = true;
    }
    for emitter in scene.emitters() {
        if let Some(x) = emitter.position() {
            lit[scene.medium_at(x)] = true;
        }
    }
    let pairs = || {
        let objects = scene.objects().iter();
        objects.filter_map(|o| Some((o, o.sides?)))
    };
    for (object, sides) in pairs().filter(|(o, _)| o.emitter.is_some()) {
        let inwards = object.shape.has_flipped_normals();
        lit[if inwards {
            sides.interior
        } else {
            sides.exterior
        }] = true;
    }
    // Mark the media of emitters that have one medium on both sides.
    for object in scene
        .objects()
        .iter()
        .filter(|o| o.sides.is_none() && o.emitter.is_some())
    {
        lit[scene.medium_at(object.shape.sample_area([0.31, 0.64]).position)] = true;
    }
    let open: Vec<[MediumId; 2]> = pairs()
        .filter(|(o, _)| !o.bsdf.is_opaque())
        .map(|(_, s)| [s.interior, s.exterior])
        .collect();
    while let Some([a, b]) = open.iter().find(|[a, b]| lit[*a] != lit[*b]) {
        (lit[*a], lit[*b]) = (true, true);
    }
    lit
}

fn warning(object: usize, name: &str, medium: &str) -> SceneProblem {
    SceneProblem::warning(
        lints::NO_LIGHT_ENTERS,
        Subject::Object(object),
        format!(
            "no light can enter medium '{medium}': the surface of '{name}' around it is opaque"
        ),
        "give the shape <bsdf type=\"null\"/> if only the medium is meant, or a dielectric; a shape without a \
               bsdf is diffuse",
    )
}
