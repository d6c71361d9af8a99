//! Pixels that pilots sample, their weights, and tiles of the image in which pilots add up samples.

use crate::scene::FilmSpec;

/// First number of a pilot's samples, beyond the numbers of all renders.
pub(super) const FIRST_SAMPLE: u64 = 1 << 63;

/// Two samples of each pixel of a pilot, summed over channels.
pub(super) type Pairs = Vec<[f64; 2]>;

/// Returns the index of the `i`-th pixel of a pilot. Multiples of the golden ratio spread evenly
/// over the image.
pub(super) fn spread(i: usize, film: &FilmSpec) -> usize {
    let pixels = film.width * film.height;
    let place = (0.618_033_988_749_894_9 * i as f64).fract();
    ((place * pixels as f64) as usize).min(pixels - 1)
}

/// Returns the index of the tile in which a pixel lies; there are `side` tiles along either side of
/// the image.
pub(super) fn tile_of(pixel: usize, film: &FilmSpec, side: usize) -> usize {
    let (column, row) = (pixel % film.width, pixel / film.width);
    row * side / film.height * side + column * side / film.width
}

/// Returns the weights of the pixels' variances, given their samples. Pixels brighter than the
/// image's mean count relative to their brightness. The edges of emitters, for example, and rare
/// bright samples are noisy whatever paths do. They must not make all other pixels look
/// unimportant.
pub(super) fn weights(pilots: &[&Pairs]) -> Vec<f64> {
    let brightness = |i: usize| pilots.iter().flat_map(move |pairs| pairs[i]).sum::<f64>();
    let pixels = pilots.iter().map(|pairs| pairs.len()).min().unwrap_or(0);
    let mean = (0..pixels).map(brightness).sum::<f64>() / pixels as f64;
    let weight = |i| (brightness(i) / mean).max(1.0).powi(-2);
    (0..pixels).map(weight).collect()
}
