//! Which pixels pilots sample, what each counts, and parts of the image in which they add up what they see.

use crate::scene::FilmSpec;

/// Numbers of the pilot's samples start here, where no render gets to.
pub(super) const FIRST: u64 = 1 << 63;

/// The samples of each pixel of a pilot, summed over channels.
pub(super) type Pairs = Vec<[f64; 2]>;

/// Pixel number `i` of a pilot: multiples of the golden ratio spread evenly over the image.
pub(super) fn spread(i: usize, film: &FilmSpec) -> usize {
    let pixels = film.width * film.height;
    let place = (0.618_033_988_749_894_9 * i as f64).fract();
    ((place * pixels as f64) as usize).min(pixels - 1)
}

/// Number of the tile in which a pixel lies, of `side` tiles along either side of the image.
pub(super) fn tile_of(pixel: usize, film: &FilmSpec, side: usize) -> usize {
    let (column, row) = (pixel % film.width, pixel / film.width);
    row * side / film.height * side + column * side / film.width
}

/// What the variances of pixels are to count, given their samples. Those brighter than the image's mean count relative to their
/// brightness: the edges of emitters, say, and rare bright samples are noisy whatever paths do, and are not to make all
/// else look unimportant.
pub(super) fn weights(pilots: &[&Pairs]) -> Vec<f64> {
    let brightness = |i: usize| pilots.iter().flat_map(move |pairs| pairs[i]).sum::<f64>();
    let pixels = pilots.iter().map(|pairs| pairs.len()).min().unwrap_or(0);
    let mean = (0..pixels).map(brightness).sum::<f64>() / pixels as f64;
    let weight = |i| (brightness(i) / mean).max(1.0).powi(-2);
    (0..pixels).map(weight).collect()
}
