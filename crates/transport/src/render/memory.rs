//! Estimates of the memory that a render takes, known before it starts.

use super::strategies::MAX_VERTICES;
use super::{RenderOptions, allocation, splats};
use crate::Spectrum;
use crate::film::{OutlierRejection, Scores, bytes_of_pixel};
use crate::integrator::Integrator;
use crate::moments::Moments;
use crate::path::{LightPath, PathVertex};
use crate::photons::Photon;
use crate::scene::{FilmSpec, Scene};

/// Maximum number of bytes of scores that a pass of more than one sample keeps until it is
/// complete. This is enough to keep all threads busy for a while, and little compared with the
/// program's other memory.
const MAX_SCORE_BYTES: usize = 1 << 25;
/// Assumed number of layers that a sample reaches. The true number depends on the scene.
const REACHED_LAYERS: usize = 8;

/// Returns the maximum number of bytes that a render takes: its films, its data about pixels, and
/// the scores that wait until a pass is complete. Not included: photon maps, long light subpaths,
/// and samples that reach many layers. Writing films to files takes additional memory, but not at
/// the same time.
pub fn memory(scene: &Scene, options: &RenderOptions) -> usize {
    let (pixels, per_unit) = (pixels(scene), scores(scene, options));
    let units = samples_of_pass(scene, options).min(options.samples) / unit(scene, options);
    let scores = per_unit.saturating_mul(units.max(1) as usize);
    let per_pixel = kept(scene.film(), options).saturating_add(pending(scene.film(), options));
    let waiting = if spreads(scene.film(), options) {
        let keeps = options.renderer.splats() || options.decomposition.is_some();
        splats::waiting(pixels, parts(options), keeps)
    } else {
        0
    };
    pixels
        .saturating_mul(per_pixel)
        .saturating_add(scores)
        .saturating_add(waiting)
}

/// Returns the maximum number of samples of a pass: whole replicates at all instants of a period.
pub(super) fn samples_of_pass(scene: &Scene, options: &RenderOptions) -> u64 {
    let units = MAX_SCORE_BYTES / scores(scene, options).max(1);
    unit(scene, options).saturating_mul(units.max(1) as u64)
}

/// Returns the number of samples that are taken together.
fn unit(scene: &Scene, options: &RenderOptions) -> u64 {
    scene.whole_periods(1, options.replicates())
}

fn pixels(scene: &Scene) -> usize {
    let film = scene.film();
    film.width.saturating_mul(film.height)
}

/// Returns the number of parts of each layer that wait with its light.
fn parts(options: &RenderOptions) -> usize {
    options.decomposition.parts.map_or(0, |parts| parts.count())
}

/// Returns the bytes of the scores of all pixels for the samples that are taken together.
fn scores(scene: &Scene, options: &RenderOptions) -> usize {
    let size = options.replicates().size() as usize;
    let replicates = unit(scene, options) as usize / size;
    let groups = groups(scene.film(), options);
    let images = 1 + debiased(options) + films_of_strategies(options);
    let layers = layers(options).min(REACHED_LAYERS.saturating_mul(size));
    let samples = if options.reweight { size } else { 0 };
    let quantities = options.quantities.map_or(0, |tracer| {
        tracer.channels().count().div_ceil(Spectrum::CHANNELS)
    });
    let replicate = (groups * images + quantities) * Scores::BYTES
        + groups * (layers + samples) * Scores::PLACED_BYTES;
    pixels(scene)
        .saturating_mul(replicate)
        .saturating_mul(replicates)
}

/// Returns the number of groups of channels.
fn groups(spec: &FilmSpec, options: &RenderOptions) -> usize {
    let channels = options.renderer.channels(spec.channels);
    channels.div_ceil(options.renderer.group_size(spec.group_size))
}

/// Returns the number of films without known bias, 0 or 1.
fn debiased(options: &RenderOptions) -> usize {
    usize::from(options.renderer.integrator().is_some_and(Integrator::blurs))
}

/// Returns the bytes per pixel of a film whose channels are in `groups` groups.
fn film(channels: usize, groups: usize) -> usize {
    bytes_of_pixel(channels) + (groups - 1) * bytes_of_pixel(0)
}

/// Returns the bytes per pixel that last for the whole render.
fn kept(spec: &FilmSpec, options: &RenderOptions) -> usize {
    let channels = options.renderer.channels(spec.channels);
    let film_of_light = film(channels, groups(spec, options));
    // Planted error "layers of films smaller than they are", found by morgana-io/render_memory::pixels_and_triangles_take_no_more_than_they_may:
    // let layer = channels * size_of::<Moments>() / 4;
    let layer = channels * size_of::<Moments>();
    let outliers = if options.reweight {
        channels * OutlierRejection::BYTES
    } else {
        0
    };
    let shares = if options.is_adaptive() {
        allocation::BYTES
    } else {
        0
    };
    let quantities = options.quantities.map_or(0, |tracer| {
        let channels = tracer.channels().count();
        film(channels, channels.div_ceil(Spectrum::CHANNELS))
    });
    film_of_light
        .saturating_mul(1 + debiased(options) + films_of_strategies(options))
        .saturating_add(layer.saturating_mul(layers(options)))
        .saturating_add(outliers + shares + quantities)
}

/// Returns true if samples contribute to several pixels.
fn spreads(spec: &FilmSpec, options: &RenderOptions) -> bool {
    options.renderer.splats() || options.cells(spec).overlap()
}

/// Returns the bytes per pixel of a sample that contributes to several pixels, in addition to the
/// scores that it becomes: values of cells, its layers, its bias, and one sample of a replicate.
fn pending(spec: &FilmSpec, options: &RenderOptions) -> usize {
    if spreads(spec, options) {
        let of_replicate = usize::from(options.replicates().size() > 1);
        let own = 1 + debiased(options);
        size_of::<Spectrum>() * (own + of_replicate + debiased(options) + layers(options))
            + light_paths(options)
    } else {
        0
    }
}

/// Assumed number of vertices of a light subpath. The true number depends on the scene.
const VERTICES: usize = 3;

/// Returns the bytes per pixel of light subpaths that all pixels share.
fn light_paths(options: &RenderOptions) -> usize {
    let integrator = options.renderer.integrator();
    if integrator.is_some_and(Integrator::shares_light_paths) {
        size_of::<LightPath>() + VERTICES * (size_of::<PathVertex>() + size_of::<Photon>())
    } else {
        0
    }
}

fn layers(options: &RenderOptions) -> usize {
    if options.decomposition.is_some() {
        options.decomposition.layers()
    } else {
        0
    }
}

/// Returns the number of films of strategies, weighted and unweighted.
fn films_of_strategies(options: &RenderOptions) -> usize {
    if options.strategies {
        2 * options.renderer.integrator().map_or(0, strategies)
    } else {
        0
    }
}

/// Returns the number of strategies that an estimator may use.
fn strategies(integrator: &Integrator) -> usize {
    let most = MAX_VERTICES;
    let (max_depth, _) = integrator.depths();
    // A path of s + t vertices has at least s + t − 1 edges.
    let fits = |s: u32, t: u32| max_depth.is_none_or(|depth| s + t <= depth.saturating_add(1));
    let pairs = (0..=most).flat_map(|s| (1..=most).map(move |t| (s, t)));
    let pairs = pairs.filter(|&(s, t)| s + t >= 2 && fits(s, t) && integrator.has_strategy(s, t));
    pairs.count()
}
