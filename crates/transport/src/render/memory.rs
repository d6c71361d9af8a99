//! How much memory a render takes per pixel, known before it starts.

use super::strategies::MOST_VERTICES;
use super::{Options, allocation};
use crate::Spectrum;
use crate::film::{Cascade, Pixel};
use crate::integrator::Integrator;
use crate::moments::Moments;
use crate::scene::FilmSpec;

/// Bytes that the films of a render take at most, with all that is kept until it is added to them, and samples that are
/// shared out among pixels. Writing films to files takes more, but not at the same time.
pub fn memory(spec: &FilmSpec, options: &Options) -> usize {
    let channels = options.integrator.channels(spec.channels);
    let groups = channels.div_ceil(options.integrator.lanes(spec.lanes));
    let pixels = spec.width.saturating_mul(spec.height);
    let film = groups * size_of::<Pixel>();
    let splats = options.integrator.splats();
    let buffer = size_of::<Spectrum>();
    let layers = match options.decomposition.is_some() {
        true => options.decomposition.layers(),
        false => 0,
    };
    let layer = channels * size_of::<Moments>() + if splats { buffer } else { 0 };
    let strategies = match options.strategies {
        true => 2 * strategies(&options.integrator),
        false => 0,
    };
    let image = film + if splats { buffer } else { 0 };
    let cascade = match options.reweight {
        true => channels * Cascade::BYTES,
        false => 0,
    };
    let shares = match options.shares_out() {
        true => allocation::BYTES,
        false => 0,
    };
    let per_pixel = (image.saturating_mul(1 + strategies) + cascade + shares)
        .saturating_add(layer.saturating_mul(layers));
    pixels.saturating_mul(per_pixel)
}

/// Number of strategies that an estimator may come up with.
fn strategies(integrator: &Integrator) -> usize {
    let most = MOST_VERTICES;
    let within = |max_depth: Option<u32>, (s, t): (u32, u32)| {
        // A path of s + t vertices has at least s + t − 1 edges.
        s + t >= 2 && max_depth.is_none_or(|depth| s + t <= depth.saturating_add(1))
    };
    let pairs = (0..=most).flat_map(|s| (1..=most).map(move |t| (s, t)));
    match integrator {
        Integrator::Path(_) | Integrator::Photon(_) | Integrator::Aov(_) => 0,
        Integrator::Particle(p) => pairs
            .filter(|&(s, t)| within(p.max_depth, (s, t)) && (t == 1 || (s, t) == (0, 2)))
            .count(),
        Integrator::Bdpt(p) => pairs.filter(|&pair| within(p.max_depth, pair)).count(),
    }
}
