//! How much memory a render takes per pixel, known before it starts.

use super::strategies::MOST_VERTICES;
use super::{RenderOptions, allocation};
use crate::Spectrum;
use crate::film::{OutlierRejection, Pixel};
use crate::integrator::Integrator;
use crate::moments::Moments;
use crate::path::{LightPath, PathVertex};
use crate::photons::Photon;
use crate::scene::FilmSpec;

/// Bytes that a render takes at most, but for photon maps and long light subpaths: its films and what it knows of pixels, the copy of
/// these that is kept so that a pass can be given up, and what is kept of samples until it is added. Writing films to files takes more, but not at the same time.
pub fn memory(spec: &FilmSpec, options: &RenderOptions) -> usize {
    let pixels = spec.width.saturating_mul(spec.height);
    let per_pixel = kept(spec, options)
        .saturating_mul(2)
        .saturating_add(pending(options));
    pixels.saturating_mul(per_pixel)
}

/// Bytes that a copy of a render takes, for each pass.
pub(super) fn copied(spec: &FilmSpec, options: &RenderOptions) -> usize {
    let pixels = spec.width.saturating_mul(spec.height);
    pixels.saturating_mul(kept(spec, options))
}

/// Bytes for each pixel that last for the whole render.
fn kept(spec: &FilmSpec, options: &RenderOptions) -> usize {
    let channels = options.renderer.channels(spec.channels);
    let groups = channels.div_ceil(options.renderer.group_size(spec.group_size));
    let film = groups * size_of::<Pixel>();
    let layer = channels * size_of::<Moments>();
    let outliers = if options.reweight {
        channels * OutlierRejection::BYTES
    } else {
        0
    };
    let shares = if options.shares_out() {
        allocation::BYTES
    } else {
        0
    };
    let quantities = options.quantities.map_or(0, |tracer| {
        tracer.channels().count().div_ceil(Spectrum::CHANNELS) * size_of::<Pixel>()
    });
    let debiased = usize::from(options.renderer.integrator().is_some_and(Integrator::blurs));
    film.saturating_mul(1 + debiased + films_of_strategies(options))
        .saturating_add(layer.saturating_mul(layers(options)))
        .saturating_add(outliers + shares + quantities)
}

/// Bytes for each pixel that hold samples that splat until they are added to the films.
fn pending(options: &RenderOptions) -> usize {
    if options.renderer.splats() {
        size_of::<Spectrum>() * (1 + films_of_strategies(options) + layers(options))
            + light_paths(options)
    } else {
        0
    }
}

/// Vertices that a light subpath is taken to have: how many it really has depends on the scene.
const VERTICES: usize = 3;

/// Bytes for each pixel of light subpaths that all pixels share.
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

/// Films of what strategies find, weighted and not.
fn films_of_strategies(options: &RenderOptions) -> usize {
    if options.strategies {
        2 * options.renderer.integrator().map_or(0, strategies)
    } else {
        0
    }
}

/// Number of strategies that an estimator may come up with.
fn strategies(integrator: &Integrator) -> usize {
    let most = MOST_VERTICES;
    let (max_depth, _) = integrator.depths();
    // A path of s + t vertices has at least s + t − 1 edges.
    let fits = |s: u32, t: u32| max_depth.is_none_or(|depth| s + t <= depth.saturating_add(1));
    let pairs = (0..=most).flat_map(|s| (1..=most).map(move |t| (s, t)));
    let pairs = pairs.filter(|&(s, t)| s + t >= 2 && fits(s, t) && integrator.has_strategy(s, t));
    pairs.count()
}
