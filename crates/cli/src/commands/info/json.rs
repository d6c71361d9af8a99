//! Description of a scene as JSON.

use super::{
    constant_index, diffraction, emission, emitted_power, extinction_and_albedo, film_memory,
    found, mean_cosine, meters, sensor_kind,
};
use crate::load::file_name;
use io::Loaded;
use io::assemble::{CondensedGrid, FactSource, SoundRecord, steps_across};
use io::rendered::Naming;
use serde_json::{Value, json};
use std::path::Path;
use transport::emitter::Emitter;
use transport::scene::MediumId;

/// Returns all facts of the text, and warnings.
pub fn describe(path: &Path, loaded: &Loaded) -> Value {
    let scene = loaded.scene();
    let emitters = scene.emitters().iter().zip(&loaded.emitter_names);
    let camera = loaded.instruments.is_empty();
    json!({
        "scene": file_name(path),
        "hash": loaded.hash.to_string(),
        "channels": loaded.channel_names,
        "samples": loaded.samples,
        "phases": scene.instants(),
        "integrator": camera.then(|| loaded.integrator()),
        "tolerance": scene.tolerance().get(),
        "film": camera.then(|| film(loaded)),
        "sensor": camera.then(|| sensor(loaded)),
        "meters": meters(loaded)
            .map(|(name, bins, bytes)| json!({ "name": name, "bins": bins, "bytes": bytes }))
            .collect::<Vec<_>>(),
        "gpu_refusal": (!camera).then(|| super::gpu_refusal(loaded)).flatten(),
        "objects": scene.objects().len(),
        "emitters": emitters.map(|(e, name)| emitter(loaded, e, name)).collect::<Vec<_>>(),
        "media": (0..scene.media().len()).map(|id| medium(loaded, id)).collect::<Vec<_>>(),
        "sounds": loaded.sounds.iter().map(sound).collect::<Vec<_>>(),
        "condensed_grids": loaded.condensed.iter().map(condensed).collect::<Vec<_>>(),
        "warnings": loaded.warnings.iter().map(|w| w.message.as_str()).collect::<Vec<_>>(),
        "differences": loaded.differences.iter().map(|d| json!({ "topic": d.topic, "text": d.text })).collect::<Vec<_>>(),
    })
}

fn film(loaded: &Loaded) -> Value {
    let film = loaded.scene().film();
    let (bytes, with_strategies) = film_memory(loaded);
    json!({
        "width": film.width,
        "height": film.height,
        "quantities": loaded.quantity_names.iter().map(|q| json!({ "name": q.name, "channels": q.channels })).collect::<Vec<_>>(),
        "moment": loaded.moment,
        "decomposition": Naming::of(loaded).map(|n| n.axes()),
        "bytes": bytes,
        "bytes_with_strategies": with_strategies,
    })
}

fn sensor(loaded: &Loaded) -> Value {
    let scene = loaded.scene();
    let (position, medium) = (scene.sensor().position(), scene.sensor_medium());
    json!({
        "type": sensor_kind(scene),
        "position": position.to_array(),
        "medium": scene.medium(medium).name,
        "index": scene.n(medium, position),
        "diffraction": diffraction(loaded),
    })
}

fn emitter(loaded: &Loaded, emitter: &Emitter, name: &str) -> Value {
    let found = found(loaded, emitter);
    json!({
        "name": name,
        "type": emitter.kind(),
        "found": found.as_ref().map(|(how, _)| how),
        "complete": found.as_ref().map(|(_, complete)| complete),
    })
}

/// Describes a grid of the index that is held with fewer samples than its file has.
fn condensed(grid: &CondensedGrid) -> Value {
    json!({
        "type": grid.plugin,
        "file": grid.file,
        "size": grid.size,
        "held": grid.held,
        "tolerance": grid.tolerance,
    })
}

/// Describes a volume of sound. Lengths are in scene units, the frequency in Hz, the time step in
/// seconds.
fn sound(record: &SoundRecord) -> Value {
    let from = |value: Value, source: FactSource| json!({ "value": value, "from": source.name() });
    let series = record.series.as_ref().map(|series| {
        json!({
            "frames": from(series.frames.into(), record.sized_by()),
            "first": series.first,
            "used": series.used,
            "time_step": series.time_step.map(|(step, source)| from(step.into(), source)),
            "residual": series.residual,
        })
    });
    json!({
        "type": record.plugin,
        "file": record.file,
        "size": from(json!(record.size), record.sized_by()),
        "spacing": from(json!(record.spacing().to_array()), record.placed_by),
        "origin": from(json!(record.origin().to_array()), record.placed_by),
        "frequency": record.frequency.map(|hz| from(hz.into(), FactSource::Scene)),
        "series": series,
    })
}

/// Describes a medium, with lengths in scene units. "extinction" and "albedo" are null in clear
/// media, "emission" in dark media. "mean_cosine" is null if light is not scattered, or if it
/// varies in space.
fn medium(loaded: &Loaded, id: MediumId) -> Value {
    let scene = loaded.scene();
    let (medium, region) = (scene.medium(id), &scene.regions()[id]);
    let bounds = &region.bounds;
    let constant = medium.index.is_constant();
    let (low, high) = if constant {
        constant_index(loaded, id)
    } else {
        (bounds.n_min(), bounds.n_max())
    };
    let range = |(low, high): (f64, f64)| json!({ "min": low, "max": high });
    let [extinction, albedo] = if medium.is_transparent() {
        [Value::Null, Value::Null]
    } else {
        extinction_and_albedo(loaded, id).map(range)
    };
    let uniqueness = region.uniqueness.as_ref();
    json!({
        "name": medium.name,
        "constant": constant,
        "index": range((low, high)),
        "max_gradient_of_log_index": bounds.kappa(),
        "steps_across": (!constant).then(|| steps_across(scene, id)),
        "unique_branches": constant || uniqueness.is_some_and(|u| u.whole_medium()),
        "longest_ray": uniqueness.map(|u| u.longest_ray()).filter(|l| l.is_finite()),
        "extinction": extinction,
        "albedo": albedo,
        "mean_cosine": mean_cosine(loaded, id).map(range),
        "emission": emission(loaded, id).map(range),
        "emitted_power": emitted_power(loaded, id).map(|[power, error]| json!({ "mean": power, "error": error })),
        "bytes": medium.memory(),
    })
}
