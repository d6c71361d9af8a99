//! Which pixels pilots sample, and parts of the image in which they add up what they see.

use crate::scene::FilmSpec;

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
