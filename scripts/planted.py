#!/usr/bin/env python3
"""Plants known errors of physics one by one and checks that a test fails for each.

Works on a copy of the tracked files, so the working tree is never touched. Each planted error is one
replacement in one file; the test named with it must compile, run, and fail. With --check, only looks whether all places are there.

Usage: scripts/planted.py [--check | NAME ...]
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
TRANSPORT = "crates/transport/src/"
EIKONAL = "crates/eikonal/src/"

# name, file, text, replacement, package, test target, test
PLANTED = [
    (
        "light from emitters scattered by shading normals as if they were the surface's",
        TRANSPORT + "bsdf/shading.rs",
        "self.eval(s, direction, toward) * ratio",
        "self.eval(s, toward, direction) * (ratio / ratio)",
        ("morgana-transport", "agreement", "shading::diffuse_and_glossy"),
    ),
    (
        "mirrors that lean as bright for light as for views",
        TRANSPORT + "bsdf/shading.rs",
        "sample.weight * s.cosine_ratio(sample.direction, toward)",
        "sample.weight",
        ("morgana-transport", "agreement", "shading::mirrors"),
    ),
    (
        "edges extended farther if they collide late",
        TRANSPORT + "path/walk/trace.rs",
        "if self.edge.geometry.events == 0 && !events.passed_by_chance && !events.is_long {",
        "if self.edge.geometry.events == 0 && !events.passed_by_chance {",
        ("morgana-transport", "edges", "extensions_of_rays_that_circle_end"),
    ),
    (
        "depths of surfaces as straight lines",
        TRANSPORT + "path/walk/follow.rs",
        "length: self.ray.length,",
        "length: self.x.distance(hit.position),",
        ("morgana-transport", "first_surface", "depth_is_measured_along_the_curve"),
    ),
    (
        "boundaries of media seen as surfaces",
        TRANSPORT + "path/walk/follow.rs",
        "self.ray.seen.is_none() && !surface.bsdf.is_null()",
        "self.ray.seen.is_none()",
        ("morgana-transport", "first_surface", "a_ball_behind_a_matched_boundary"),
    ),
    (
        "second moments of one sample too few",
        TRANSPORT + "moments.rs",
        "n => self.sum_of_squares.value() / n as f64",
        "n => self.sum_of_squares.value() / (n as f64 - 1.0)",
        ("morgana-transport", "second_moment", "it_is_the_mean_of_squares"),
    ),
    (
        "rays given up without being counted",
        TRANSPORT + "path/walk/follow.rs",
        "ws.stats.over_budget.rays += u64::from(is_over);",
        "",
        ("morgana-transport", "budgets", "rays_that_take_too_many_steps_are_given_up_and_counted"),
    ),
    (
        "directions of turned skies a little too long",
        TRANSPORT + "orientation.rs",
        "(self.0 * local).normalize()",
        "self.0 * local * (1.0 + 1e-7)",
        ("morgana-transport", "orientation", "directions_have_unit_length_there_and_back"),
    ),
    (
        "facets of Gaussian slopes seen as often from the side as from above",
        TRANSPORT + "bsdf/beckmann.rs",
        "cos * libm::erfc(-s) + sin * FRAC_1_SQRT_PI * libm::exp(-s * s)",
        "cos * libm::erfc(-s) + sin * 0.5 * libm::exp(-s * s)",
        ("morgana-transport", "bsdf", "facets_cover_the_surface_once"),
    ),
    (
        "brushed facets as steep along the grooves as others are across them",
        TRANSPORT + "bsdf/microfacet.rs",
        "let sin2 = Self::sin2(h, [v, u]);",
        "let sin2 = Self::sin2(h, [u, v]);",
        ("morgana-transport", "bsdf", "anisotropic_facets_as_published"),
    ),
    (
        "light under a coating as bright as before it spread over wider angles",
        TRANSPORT + "bsdf/coating.rs",
        "outside.z / (self.eta * self.eta * inside.z)",
        "outside.z / inside.z",
        ("morgana-transport", "bsdf", "smooth_coatings_let_out_what_fresnel_says"),
    ),
    (
        "discs in the sky brighter than their radiance over their solid angle",
        TRANSPORT + "emitter/distant_disc.rs",
        "TAU * self.height",
        "TAU * self.height * 0.9",
        ("morgana-transport", "emitters", "discs_in_the_sky_are_sampled_by_their_density"),
    ),
    (
        "strategies weighed as if all were used",
        TRANSPORT + "integrator/bidirectional/weight.rs",
        "power(rates.of(*kind)) * kinds[*kind as usize]",
        "kinds[*kind as usize]",
        ("morgana-transport", "connections", "any_rate_of_strategies_is_unbiased"),
    ),
    (
        "light that arrives in other pixels left out of the choice of the integrator",
        TRANSPORT + "render/candidate_pilot.rs",
        "cell.squares / (share * self.paths)",
        "0.0 * cell.squares / (share * self.paths)",
        ("morgana-transport", "choice", "pilots_foretell_variances"),
    ),
    (
        "the index along a ray taken from its speed in optical path differences",
        EIKONAL + "difference/straight.rs",
        "contrast: field.n2(arc.position(theta)) - n2_ref,",
        "contrast: arc.velocity(theta).length_squared() - n2_ref,",
        ("morgana-eikonal", "path_difference", "weak_columns_have_the_integral_of_their_contrast"),
    ),
    (
        "reference rays of their own span in optical path differences",
        EIKONAL + "difference/curved.rs",
        "jet.n2 - rho * rho * jet",
        "jet.n2 - jet",
        ("morgana-eikonal", "path_difference_field", "rods_of_other_strength_have_a_closed_form"),
    ),
    (
        "third differences for fourth in smoothing splines",
        EIKONAL + "field/bspline/smooth.rs",
        "[1.0, -4.0, 6.0, -4.0, 1.0]",
        "[0.0, -1.0, 3.0, -3.0, 1.0]",
        ("morgana-eikonal", "field_noise", "smoothing_keeps_what_is_no_noise"),
    ),
    (
        "samples shared out by what the image itself has seen",
        TRANSPORT + "render/allocation.rs",
        "const FIRST: u64 = 1 << 62;",
        "const FIRST: u64 = 0;",
        ("morgana-transport", "adaptive", "what_a_pilot_sees_by_chance_does_not_bias_the_image"),
    ),
    (
        "samples that a pixel takes twice",
        TRANSPORT + "render/allocation.rs",
        "self.taken(unit, share)..self.taken(unit + 1, share)",
        "self.taken(unit, share)..self.taken(unit + 1, share) + 1",
        ("morgana-transport", "adaptive", "errors_are_smaller_and_true_and_means_agree"),
    ),
    (
        "light found by chance taken for the same however rare connections are",
        TRANSPORT + "path/learnt/nee_rates.rs",
        "*mean += value / (1.0 - share + probability(level) * share);",
        "*mean += value;",
        ("morgana-transport", "connections", "a_pilot_foretells_variances"),
    ),
    (
        "lines that leave a ball inwards said not to meet it again",
        TRANSPORT + "shape/mod.rs",
        "let outward = || (normal.dot(direction) > 0.0) != self.has_flipped_normals();",
        "let outward = || true;",
        ("morgana-transport", "edges", "straight_connections_are_those_of_the_solver"),
    ),
    (
        "parts of a grid taken for unchanging one block too far",
        EIKONAL + "field/bspline/homogeneous.rs",
        "let low = ((middle + 1.0 - layers) * edge)",
        "let low = ((middle - layers) * edge)",
        ("morgana-eikonal", "homogeneous", "nothing_changes_where_nothing_is_said_to_change"),
    ),
    (
        "distances around a light of another density than they are sampled with",
        TRANSPORT + "path/segment/equiangular.rs",
        "(a + (b - a) * u).tan()",
        "(a + (b - a) * u * u).tan()",
        ("morgana-io", "reference", "fog_beside_a_point_light"),
    ),
    (
        "every wavelength refracted as the first",
        "crates/io/src/assemble/channels.rs",
        "Some(nm[self.first(group)])",
        "Some(nm[0])",
        ("morgana-io", "dispersion", "a_glass_ball_deflects_each_wavelength_by_snells_law"),
    ),
    (
        "half of the instants of a period left out",
        TRANSPORT + "scene/period.rs",
        "match (sample % self.instants() as u64) as usize {",
        "match (sample % self.instants() as u64 / 2) as usize {",
        ("morgana-transport", "period", "averaged_fluence_is_the_mean_of_the_instants"),
    ),
    (
        "fluence of particles weighted by n²",
        TRANSPORT + "meter/fluence.rs",
        "let fluence = power * (length - before);",
        "let n2 = arc.velocity(0.0).length_squared(); "
        "let fluence = power * ((length - before) * n2);",
        ("morgana-transport", "meters", "fluence_in_a_furnace_is_that_of_the_index_squared"),
    ),
    (
        "reflected light counted as light that passes",
        TRANSPORT + "meter/recorder.rs",
        "if opaque || side(direction) == side(arrival) {",
        "if opaque || !side(direction) || side(direction) {",
        ("morgana-transport", "meters", "a_half_space_with_an_index_of_its_own"),
    ),
    (
        "particles that are divided keep all their power each",
        TRANSPORT + "meter/particle.rs",
        "ray.throughput *= 1.0 / copies as f64;",
        "ray.throughput *= 1.0;",
        ("morgana-transport", "meters", "an_infinite_medium_absorbs_exponentially"),
    ),
    (
        "survivors of roulette not weighted by the probability of that",
        TRANSPORT + "integrator/path/roulette.rs",
        "next.throughput *= 1.0 / survival;",
        "next.throughput *= 1.0;",
        ("morgana-transport", "roulette", "absurd_adjoint_estimates_keep_the_mean"),
    ),
    (
        "adjoint estimates learnt from what paths brought before, not after",
        TRANSPORT + "path/learnt/adjoint_training.rs",
        "departure.tally.light = end.light - departure.tally.light;",
        "departure.tally.light *= 1.0;",
        ("morgana-transport", "roulette", "adjoint_estimates_are_worth_what_paths_brought"),
    ),
    (
        "radiance weighted by 1/n² of the sensor instead of n²",
        TRANSPORT + "integrator/path.rs",
        "if c < channels { n * n } else { 0.0 }",
        "if c < channels { 1.0 / (n * n) } else { 0.0 }",
        ("morgana-transport", "furnace", "luneburg_ball_of_fog"),
    ),
    (
        "emission not divided by n² of the emitter",
        TRANSPORT + "integrator/path.rs",
        "let light = found.radiance / (found.n * found.n) * weight;",
        "let light = found.radiance * weight;",
        ("morgana-transport", "slabs", "graded_slab_between_black_plates"),
    ),
    (
        "refraction computed from the chord of the last arc",
        TRANSPORT + "path/walk/surface.rs",
        "let Some(sample) = self.sample(object, hit, &surface, -direction) else {",
        "let toward = self.edge.spans.last().map_or(-direction, "
        "|s| (s.arc.start() - hit.position).normalize());"
        "let Some(sample) = self.sample(object, hit, &surface, toward) else {",
        ("morgana-transport", "edges", "refraction_uses_the_tangent_of_the_ray"),
    ),
    (
        "1/d² as geometry term",
        TRANSPORT + "path/connection/search/found.rs",
        "geometry_term: throughput.jump / (ray.jacobian * n_last * n_last),",
        "geometry_term: throughput.jump / (ray.start.distance_squared(candidate.end_point) * n_last * n_last),",
        ("morgana-transport", "tallies", "irradiance_of_a_luneburg_ball_around_a_point_source"),
    ),
    (
        "chord directions in the scattering function",
        TRANSPORT + "path/connection/search/found.rs",
        "let (near, far) = (ray.direction_out, -ray.direction_in);",
        "let near = (candidate.end_point - ray.start).normalize(); let far = -near;",
        ("morgana-transport", "edges", "connections_follow_the_harmonic_orbit"),
    ),
    (
        "a picture on a sphere shines with the mean of its pixels",
        TRANSPORT + "shape/chart.rs",
        "FRAC_PI_2 * (PI * q.y).sin()",
        "1.0",
        ("morgana-transport", "ends", "textured::powers_in_closed_form"),
    ),
    (
        "points of a textured light weighted as if they were spread evenly",
        TRANSPORT + "emitter/textured.rs",
        "pdf: sample.pdf * density,",
        "pdf: sample.pdf,",
        ("morgana-transport", "panel", "irradiance_below_the_panel"),
    ),
    (
        "failed connections not compensated by chance hits",
        TRANSPORT + "integrator/path.rs",
        """if !edge.connectable {
            return 1.0;""",
        """if !edge.connectable {
            return 0.0;""",
        ("morgana-transport", "furnace", "many_reflections_in_a_block_of_glass"),
    ),
    (
        "solver tolerance looser than the distance to the wall",
        EIKONAL + "connect/solver.rs",
        "miss <= self.allowed_miss(&trial.family, hit, floor)",
        "miss <= self.tolerance.get() * distance",
        ("morgana-transport", "slabs", "mcml_mismatched_half_space"),
    ),
    (
        "MIS density without the Jacobian in one strategy",
        TRANSPORT + "integrator/path/connecting.rs",
        "let by_chance = connection.geometry.density(pdf, connection.n_end)\n",
        "let by_chance = pdf\n",
        ("morgana-transport", "connections", "any_rate_is_unbiased"),
    ),
    (
        "visibility along the chord",
        TRANSPORT + "scene/world.rs",
        """        let last = arcs.len().saturating_sub(1);""",
        """        let arcs: Vec<_> = arcs.collect();
        let ends = (arcs[0].0.start(), arcs[arcs.len() - 1].0.end());
        let chord = Arc::line(ends.0, ends.1 - ends.0, 1.0);
        if target.is_some() || first_of(&self.blockers, &chord, [0.0, 1.0], [None; 2]).is_none() {
            return Some(all);
        }
        let (last, arcs) = (arcs.len().saturating_sub(1), arcs.into_iter());
        if last < usize::MAX {
            return None;
        }""",
        ("morgana-transport", "edges", "occlusion_follows_the_arc"),
    ),
    (
        "path cut one arc short at the boundary",
        TRANSPORT + "path/walk/trace.rs",
        "self.travelled.depth += depth;",
        "if theta_end == 1.0 { self.travelled.depth += depth; }",
        ("morgana-transport", "edges", "an_edge_is_as_long_as_its_way"),
    ),
    (
        "point light in fog without care for 1/r²",
        TRANSPORT + "scene/emission.rs",
        "if !parts.media.iter().any(Medium::scatters) {",
        "if parts.media.iter().any(Medium::scatters) {",
        ("morgana-io", "reference", "fog_around_a_point_light"),
    ),
    (
        "distances weighted by one channel's density only",
        TRANSPORT + "path/segment/edge.rs",
        "(channel_pdf * point.rate * point.depth.exp_neg() * self.forcing).sum()",
        "point.rate[0] * (-point.depth[0]).exp() * self.forcing[0]",
        ("morgana-transport", "furnace", "chromatic_extinction"),
    ),
    (
        "index jump at a declared match scored as if matched",
        TRANSPORT + "path/walk/surface.rs",
        "self.edge.weight *= ratio * ratio;",
        "",
        ("morgana-transport", "furnace", "transparent_lens_behind_a_matched_boundary"),
    ),
    (
        "tangents without the Hessian",
        EIKONAL + "ray/tangent.rs",
        "(jet.n2, jet.grad * 0.5, jet.hess * 0.5)",
        "(jet.n2, jet.grad * 0.5, jet.hess * 0.0)",
        ("morgana-eikonal", "rays", "tangents_are_the_derivative_of_the_discrete_map"),
    ),
    (
        "tangents of a ray without a shot without the Hessian",
        EIKONAL + "connect/collocate/linear.rs",
        "turned(&self.half_hess[i], dx[i]) * self.span2",
        "turned(&self.half_hess[i], dx[i]) * 0.0",
        ("morgana-eikonal", "collocation", "rays_are_as_good_as_the_tolerance_says"),
    ),
    (
        "a ray without a shot after one round, whatever the Hessians",
        EIKONAL + "connect/collocate/level.rs",
        "if self.settles(problem, &solution, &u) {",
        "if self.settles(problem, &solution, &u) || true {",
        ("morgana-eikonal", "collocation", "rays_are_as_good_as_the_tolerance_says"),
    ),
    (
        "subpaths from emitters with the points of those from the sensor",
        TRANSPORT + "integrator/bdpt.rs",
        "sampler.apart(|s| emitter_path(scene, &bounds, s, ws))",
        "emitter_path(scene, &bounds, sampler, ws)",
        ("morgana-transport", "replicates", "so_they_are_with_subpaths_from_both_ends"),
    ),
    (
        "one wrong digit in the step scheme",
        EIKONAL + "ray/step.rs",
        "0.5 - (0.245298957184271 + 0.604872665711080),",
        "0.5 - (0.245298957184271 + 0.604972665711080),",
        ("morgana-eikonal", "rays", "the_scheme_converges_at_fourth_order"),
    ),
    (
        "further branches dropped",
        TRANSPORT + "path/connection/find.rs",
        "} else if sampler.next_1d() < ws.search {",
        "} else if sampler.next_1d() < 0.0 {",
        ("morgana-transport", "branches", "branches_are_summed"),
    ),
    (
        "further branches dropped: the estimators disagree",
        TRANSPORT + "path/connection/find.rs",
        "} else if sampler.next_1d() < ws.search {",
        "} else if sampler.next_1d() < 0.0 {",
        ("morgana-transport", "agreement", "branches::estimators_agree_on_all_branches"),
    ),
    (
        "1/d² as geometry term: the estimators disagree",
        TRANSPORT + "path/connection/search/found.rs",
        "geometry_term: throughput.jump / (ray.jacobian * n_last * n_last),",
        "geometry_term: throughput.jump / (ray.start.distance_squared(candidate.end_point) * n_last * n_last),",
        ("morgana-transport", "agreement", "branches::estimators_agree_on_all_branches"),
    ),
    (
        "reciprocal probability of a branch replaced by one",
        TRANSPORT + "path/connection/search/random.rs",
        "return Some((value, f64::from(trials)));",
        "return Some((value, f64::from(trials.min(1))));",
        ("morgana-transport", "branches", "branches_are_summed"),
    ),
    (
        "probability of the search not divided out",
        TRANSPORT + "path/connection/find.rs",
        "(value, weight / ws.search)",
        "(value, weight)",
        ("morgana-transport", "branches", "branches_are_summed"),
    ),
    (
        "branches averaged instead of summed",
        TRANSPORT + "path/connection/find.rs",
        """        values
    }""",
        """        let share = 1.0 / values.len().max(1) as f64;
        let values: Found<T> = values;
        values.into_iter().map(|(v, w)| (v, w * share)).collect()
    }""",
        ("morgana-transport", "branches", "branches_are_summed"),
    ),
    (
        "reverse density of the direction in which the path came",
        TRANSPORT + "path/subpath/vertices.rs",
        "self.vertex.seen_from(from).pdf(scene, self.edge.back)",
        "self.vertex.seen_from(from).pdf(scene, -self.edge.back)",
        ("morgana-transport", "furnace", "bidirectional_estimators"),
    ),
    (
        "density without the Jacobian between two subpaths",
        TRANSPORT + "integrator/bidirectional/paths.rs",
        "let arrival = connection.geometry.density(from_z, connection.n_end) * event;",
        "let arrival = from_z * event;",
        ("morgana-transport", "furnace", "bidirectional_estimators"),
    ),
    (
        "light image not multiplied by n² of the sensor",
        TRANSPORT + "integrator/bidirectional/paths.rs",
        "let importance = connection.n_end * connection.n_end * sensed.density;",
        "let importance = sensed.density;",
        ("morgana-transport", "reciprocity", "light_and_sensor"),
    ),
    (
        "beam followed through another medium than it starts in",
        TRANSPORT + "path/connection/search/mod.rs",
        "                    && self.scene.medium_at(ray.start) == candidate.start.region\n",
        "",
        ("morgana-transport", "beams", "all_of_a_beam_goes_through_a_graded_tank"),
    ),
    (
        "filter of the light image not normalised",
        TRANSPORT + "render/splats.rs",
        "image[pixel] += value * filter;",
        "image[pixel] += value * filter.ceil();",
        ("morgana-transport", "agreement", "estimators_agree_quickly"),
    ),
    (
        "discovery of rare branches ignored in one strategy",
        TRANSPORT + "integrator/bidirectional/paths.rs",
        "discovery: connection.discovery * (chosen / source),",
        "discovery: 0.0 * (chosen / source),",
        ("morgana-transport", "furnace", "bidirectional_estimators"),
    ),
    (
        "wrong ray tube from a point to a plane",
        TRANSPORT + "path/segment/edge_geometry.rs",
        "proper(jump / spread.abs())",
        "proper(jump * 0.25 / spread.abs())",
        ("morgana-transport", "furnace", "bidirectional_estimators"),
    ),
    (
        "share of a transmission not in its contribution",
        TRANSPORT + "bsdf/dielectric.rs",
        "(self.specular_transmittance, 1.0 - f)",
        "(self.specular_transmittance, 1.0)",
        ("morgana-transport", "slabs", "mcml_mismatched_half_space"),
    ),
    (
        "optical length of light from outside counted from its end",
        TRANSPORT + "path/segment/length.rs",
        "around.radius * scene.n(AMBIENT, around.center)",
        "0.0 * around.radius * scene.n(AMBIENT, around.center)",
        ("morgana-transport", "layers", "light_from_outside_counts_from_the_ball_around_the_scene"),
    ),
    (
        "geometric in place of optical length",
        TRANSPORT + "path/walk/trace.rs",
        "self.lengthen(arc.optical_length(theta.unwrap_or(theta_end)));",
        "self.lengthen(arc.arc_length(theta.unwrap_or(theta_end)));",
        ("morgana-transport", "layers", "all_rays_of_a_luneburg_ball_are_equally_long"),
    ),
    (
        "optical length of the emitter's subpath forgotten where subpaths are joined",
        TRANSPORT + "integrator/bidirectional/paths.rs",
        "z.optical_length + connection.optical_length + y.optical_length",
        "z.optical_length + connection.optical_length",
        ("morgana-transport", "layers", "estimators_agree_in_every_bin"),
    ),
    (
        "photons without 1/n²",
        TRANSPORT + "photons/photon.rs",
        "power: path_vertex.throughput / (n * n * paths as f64 * vertex.stopping(scene)),",
        "power: path_vertex.throughput / (n * 1.0 * paths as f64 * vertex.stopping(scene)),",
        ("morgana-transport", "photons", "photons_show_what_bdpt_shows"),
    ),
    (
        "merging left out of the weights",
        TRANSPORT + "integrator/bidirectional/weight.rs",
        "own: own / (used + merged),",
        "own: own / used,",
        ("morgana-transport", "photons", "merging_shows_what_connections_show"),
    ),
    (
        "light scattered twice where vertices are merged in a medium",
        TRANSPORT + "integrator/bidirectional/paths.rs",
        "let inverse = |s: f64| if s > 0.0 { s.recip() } else { 0.0 };",
        "let inverse = |_: f64| 1.0;",
        ("morgana-transport", "photons", "merging_in_fog_shows"),
    ),
    (
        "the kernel of a disc too high",
        TRANSPORT + "photons/kernel.rs",
        "peak: 3.0 / (PI * radius.powi(2)),",
        "peak: 4.0 / (PI * radius.powi(2)),",
        ("morgana-transport", "photons", "photons_show_what_bdpt_shows"),
    ),
    (
        "light that smooth surfaces absorb is missing from the energy balance",
        TRANSPORT + "path/random_walk/balance.rs",
        "let weight = pair[0].weight_before - pair[1].weight_before;",
        "let weight = pair[1].weight_before - pair[1].weight_before;",
        ("morgana-transport", "meters", "every_particle_is_accounted_for"),
    ),
    (
        "connections pass masks and panes unweakened",
        TRANSPORT + "path/connection/ray.rs",
        "self.factor *= through.factor * through.probability;",
        "self.factor *= through.factor;",
        ("morgana-transport", "agreement", "textures_and_masks"),
    ),
    (
        "edges beside mirror lobes taken for such that connections find",
        TRANSPORT + "path/subpath/vertices.rs",
        "            0.0\n        } else {\n            self.edge.discovery",
        "            self.edge.discovery\n        } else {\n            self.edge.discovery",
        ("morgana-transport", "agreement", "partial_mirrors"),
    ),
    (
        "probability of a connection not in its weight",
        TRANSPORT + "integrator/path.rs",
        "let by_connection = self.ws.rates.of(slot) * chosen * found.pdf * samples;",
        "let by_connection = chosen * found.pdf * samples;",
        ("morgana-transport", "connections", "any_rate_is_unbiased"),
    ),
    (
        "choice among many lights taken for an even one in the weights of chance",
        TRANSPORT + "integrator/path.rs",
        "let by_connection = self.ws.rates.of(slot) * chosen * found.pdf * samples;",
        "let by_connection = self.ws.rates.of(slot) * (chosen * 0.0 + 1.0 / 30.0) * found.pdf * samples;",
        ("morgana-transport", "connections", "many_lights"),
    ),
    (
        "weights that were asked for seldom not made up for",
        TRANSPORT + "integrator/path.rs",
        "1.0 - share / asked",
        "1.0 - share",
        ("morgana-transport", "connections", "any_rate_is_unbiased"),
    ),
    (
        "point lights chosen along an edge as at its end",
        TRANSPORT + "integrator/path/connecting.rs",
        "let by_distance = by_distance * around.pdf(point.length);",
        "let by_distance = by_distance.max(chosen) * around.pdf(point.length);",
        ("morgana-transport", "connections", "many_points_add_up"),
    ),
    (
        "forced collisions weighed as by chance",
        "crates/transport/src/path/segment/edge.rs",
        "(channel_pdf * point.rate * point.depth.exp_neg() * self.forcing).sum()",
        "(channel_pdf * point.rate * point.depth.exp_neg()).sum()",
        ("morgana-transport", "first_vertex", "single_scattering_has_no_variance"),
    ),
    (
        "forced collisions in one channel's density only",
        "crates/transport/src/path/walk/trace.rs",
        "self.edge.forcing = whole.map(|depth| {",
        "self.edge.forcing = whole.map(|_| whole[0]).map(|depth| {",
        ("morgana-transport", "first_vertex", "means_stay"),
    ),
    (
        "forced collisions spread evenly over depths",
        "crates/transport/src/path/walk/trace.rs",
        "let target = -(-rank / self.edge.forcing[channel]).ln_1p();",
        "let target = rank * whole[channel];",
        ("morgana-transport", "first_vertex", "depths_have_their_distribution"),
    ),
    (
        "distances around lights weighed against collisions by chance where they are forced",
        "crates/transport/src/integrator/path/connecting.rs",
        "let by_collision = edge.collision_density(sampled.channel_pdf, &point) * chosen;",
        "let by_collision = edge.collision_density(sampled.channel_pdf, &point) * chosen "
        "/ edge.forcing[0];",
        ("morgana-transport", "first_vertex", "means_stay"),
    ),
    (
        "collisions forced before surfaces",
        "crates/transport/src/path/walk/trace.rs",
        "if !events.escaped || events.is_long || is_specular || events.passed_by_chance {",
        "if is_specular || events.passed_by_chance {",
        ("morgana-transport", "first_vertex", "only_what_would_leave_is_forced"),
    ),
    (
        "splitting that leave refracted light as it is",
        "crates/transport/src/path/walk/surface.rs",
        "Some(certain(other))",
        "Some(other)",
        ("morgana-transport", "first_vertex", "parts_add_up"),
    ),
    (
        "splitting without what media took before",
        "crates/transport/src/path/walk/surface.rs",
        "let so_far = share(self.sampling.channel_pdf, self.edge.geometry.depth) * self.edge.weight;",
        "let so_far = self.edge.weight;",
        ("morgana-transport", "first_vertex", "splitting_keeps_means"),
    ),
    (
        "splitting that are followed where they bring nothing",
        "crates/transport/src/integrator/path.rs",
        "(!throughput.is_zero()).then(|| Next {",
        "true.then(|| Next {",
        ("morgana-transport", "first_vertex", "a_split_that_brings_nothing_is_left"),
    ),
    (
        "pilots that try nothing where samples of the milky ball's kind are taken",
        "crates/transport/src/render/pilot.rs",
        "const DEAR: f64 = 220.0;",
        "const DEAR: f64 = 50.0;",
        ("morgana-transport", "first_vertex", "pilots_choose_what_pays"),
    ),
    (
        "pilots that choose what they have not seen",
        "crates/transport/src/render/pilot.rs",
        "if self.pairs == other.pairs {",
        "if false {",
        ("morgana-transport", "first_vertex", "pilots_choose_what_pays"),
    ),
    (
        "splitting that start anew",
        "crates/transport/src/integrator/path.rs",
        "length: self.length.and(0, split.optical_length),",
        "length: self.length,",
        ("morgana-transport", "first_vertex", "reflections_have_no_variance"),
    ),
]


def copy_tree(target: pathlib.Path) -> None:
    files = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    for name in filter(None, files.split("\0")):
        destination = target / name
        destination.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, destination)


def outcome(tree: pathlib.Path, package: str, target: str, test: str) -> str:
    command = ["cargo", "test", "-p", package, "--test", target, "--", test]
    run = subprocess.run(
        command,
        cwd=tree,
        capture_output=True,
        text=True,
        env={**os.environ, "CARGO_TARGET_DIR": str(ROOT / "target" / "planted")},
    )
    if "test result: FAILED" in run.stdout:
        return "caught"
    return "MISSED" if "test result: ok" in run.stdout else "did not compile:\n" + run.stderr[-2000:]


def stale() -> list[str]:
    """Entries whose place is not in the source, or not just once."""
    return [
        f"{name}: the text to replace is not found exactly once in {file}"
        for name, file, text, *_ in PLANTED
        if (ROOT / file).read_text().count(text) != 1
    ]


def main() -> int:
    if messages := stale():
        sys.exit("\n".join(messages))
    wanted = sys.argv[1:]
    if wanted == ["--check"]:
        return 0
    names = [planted[0] for planted in PLANTED]
    unknown = [word for word in wanted if not any(word in name for name in names)]
    if unknown:
        sys.exit(f"no planted error is called so: {', '.join(unknown)}")
    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        tree = pathlib.Path(directory)
        copy_tree(tree)
        for name, file, text, replacement, (package, target, test) in PLANTED:
            if wanted and not any(word in name for word in wanted):
                continue
            path = tree / file
            original = path.read_text()
            path.write_text(original.replace(text, replacement))
            result = outcome(tree, package, target, test)
            path.write_text(original)
            missed += result != "caught"
            print(f"{name}: {result} by {package}/{target}::{test}", flush=True)
    print(f"{missed} not caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
