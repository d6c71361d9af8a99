//! Statistics of runs as JSON.

use crate::Loaded;
use crate::rendered::Naming;
use serde_json::{Value, json};
use transport::meter::RecordTable;
use transport::render::{EnergyBalance, Rendering, Share};
use transport::stats::{ConnectionCounts, Stats};
use transport::{Film, Scene};

/// Adds the statistics of a render to `run`, an object with the caller's own entries.
pub fn render(loaded: &Loaded, rendering: &Rendering, mut run: Value) -> Value {
    let film = &rendering.film;
    let entries = [
        ("scene_hash", json!(loaded.hash.to_string())),
        ("spp", json!(rendering.samples)),
        ("spp_of_pixels", json!(film.least_and_most())),
        ("sampler", json!(film.replicates().name())),
        ("adaptive", json!(loaded.adaptive)),
        ("tolerance", json!(rendering.accuracy.tolerance)),
        (
            "tolerance_effect",
            json!(rendering.accuracy.effect_beside_noise(rendering.samples)),
        ),
        (
            "forced_collisions",
            json!(rendering.first_vertex.forced_collisions),
        ),
        ("splitting", json!(rendering.first_vertex.splitting)),
        ("samples", json!(film.samples())),
        ("counters", counters(&rendering.stats)),
        ("branches", branches(loaded.scene())),
        (
            "connections",
            connections(&rendering.stats, rendering.search),
        ),
        ("trust", json!(trust(loaded, film))),
        ("photons", json!(photons(rendering))),
        ("quantities", json!(quantities(loaded, rendering))),
        ("balance", json!(rendering.balance.as_ref().map(balance))),
        (
            "decomposition",
            json!(Naming::of(loaded).map(|n| n.json(film))),
        ),
    ];
    for (key, value) in entries {
        run[key] = value;
    }
    run
}

/// Returns the number of records of detected light that a meter has kept.
pub fn records(table: &RecordTable) -> Value {
    json!({
        "count": table.particle.len(),
        "particles": table.particles,
    })
}

/// Returns the counters of a run.
pub fn counters(stats: &Stats) -> Value {
    json!({
        "paths": stats.paths,
        "edges": stats.edges,
        "edges_in_cells": stats.in_cells,
        "lost": stats.lost,
        "over_budget": over_budget(stats),
        "not_finite": stats.not_finite,
        "steps": stats.work.steps,
        "steps_rejected": stats.work.rejected,
        "field_evaluations": stats.work.evaluations,
        "shots": stats.work.shots,
    })
}

/// Returns the statistics of connections. `search` is the probability with which a connection was
/// searched for further branches.
pub fn connections(stats: &Stats, search: f64) -> Value {
    let c = &stats.connections;
    json!({
        "attempts": c.attempts,
        "candidates": c.candidates,
        "found": c.found,
        "discarded": c.discarded,
        "occluded": c.occluded,
        "not_converged": c.not_converged,
        "ray_lost": c.ray_lost,
        "over_budget": stats.over_budget.connections,
        "degenerate": c.degenerate,
        "failure_rate": c.failure_rate(),
        "success_rate": share(c.found as f64, c.attempts as f64),
        "shots_per_attempt": share(stats.work.shots as f64, c.attempts as f64),
        "certified": c.certified,
        "certificate_coverage": coverage(c, search),
        "search_probability": search,
        "searches": c.searches,
        "secondary": c.secondary,
        "trials": c.trials,
        "capped": c.capped,
        "possible_bias": (c.capped > 0).then_some("capped"),
    })
}

/// Returns the numbers of rays, connections and searches for photons that were given up after too
/// many steps.
pub fn over_budget(stats: &Stats) -> Value {
    let over = &stats.over_budget;
    json!({"rays": over.rays, "connections": over.connections, "gathers": over.gathers})
}

/// Describes in a few words which computations were abandoned after too many steps. Their light is
/// missing. Returns `None` if there were none.
pub fn possible_bias(stats: &Stats) -> Option<String> {
    let over = &stats.over_budget;
    let counts = [
        (over.rays, "ray", "rays"),
        (over.connections, "connection", "connections"),
        (over.gathers, "search for photons", "searches for photons"),
    ];
    let counts = counts.iter().filter(|(count, ..)| *count > 0);
    let counts: Vec<_> = counts
        .map(|(count, one, many)| format!("{count} {}", if *count == 1 { one } else { many }))
        .collect();
    let what = counts.join(", ");
    (!counts.is_empty()).then(|| format!("possible bias: {what} given up after too many steps"))
}

/// Returns the limits within which connections search for branches.
pub fn branches(scene: &Scene) -> Value {
    let reach = scene.branch_reach();
    json!({
        "reflections": reach.reflections,
        "reflections_in_all": reach.bounces,
        "optical_length": reach.optical_length,
    })
}

/// Returns data on the reliability of the errors of the image's mean and of pixels. Returns `None`
/// for quantities other than light, which may have either sign.
pub fn trust(loaded: &Loaded, film: &Film) -> Option<Value> {
    loaded.renderer.is_light().then(|| {
        json!({
            "few": film.few_in_all(None),
            "largest_share": film.tail(None).share(),
            "few_pixels": film.few_pixels(None),
        })
    })
}

/// Returns the statistics of photon maps, if there are any.
pub fn photons(rendering: &Rendering) -> Option<Value> {
    let photons = &rendering.stats.photons;
    let film: &Film = &rendering.film;
    rendering.debiased.as_ref().map(|debiased| {
        json!({
            "in_media": photons.in_media,
            "on_surfaces": photons.on_surfaces,
            "radius": rendering.first_radius,
            "bias": debiased.bias(film),
            "error": debiased.error(film),
            "possible_bias": "blur of photons",
        })
    })
}

/// Returns the statistics of rays that were traced for quantities besides light, if there are any.
pub fn quantities(loaded: &Loaded, rendering: &Rendering) -> Option<Value> {
    let names = loaded.quantity_names.iter().map(|q| q.name.as_str());
    rendering.quantities.as_ref().map(|quantities| {
        json!({
            "names": names.collect::<Vec<_>>(),
            "rays": quantities.stats.paths,
            "lost": quantities.stats.lost,
            "over_budget": quantities.stats.over_budget.rays,
            "not_finite": quantities.stats.not_finite,
        })
    })
}

/// Returns the energy balance: the destinations of the emitted power, as fractions.
pub fn balance(b: &EnergyBalance) -> Value {
    let share = |share: Share| json!({"mean": share.mean, "standard_error": share.error});
    json!({
        "emitted": b.emitted,
        "absorbed_by_media": share(b.media),
        "absorbed_by_surfaces": share(b.surfaces),
        "escaped": share(b.escaped),
        "cut_off": share(b.cut),
        "lost": share(b.lost),
        "fluorescence": share(b.fluorescence),
        "left_over": share(b.residual),
    })
}

/// Returns a ratio; `None` if `whole` is 0.
fn share(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

/// Returns the fraction of pairs that are certified to be connected by at most one ray. Of the
/// other pairs, only searched ones are counted; dividing by `search` estimates the total.
fn coverage(connections: &ConnectionCounts, search: f64) -> Option<f64> {
    let certified = connections.certified as f64;
    share(certified, certified + connections.searches as f64 / search)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn searches_stand_for_the_pairs_that_were_not_searched() {
        let connections = ConnectionCounts {
            certified: 30,
            searches: 10,
            ..ConnectionCounts::default()
        };
        assert_eq!(coverage(&connections, 1.0), Some(0.75));
        assert_eq!(coverage(&connections, 1.0 / 9.0), Some(0.25));
        assert_eq!(coverage(&ConnectionCounts::default(), 1.0), None);
    }
}
