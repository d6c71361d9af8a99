//! How often it pays to search for further branches, found out before the render.

use super::source::Source;

/// Samples of the pilot, spread over the image.
const SAMPLES: usize = 64;
/// Numbers of the pilot's samples start here, where no render gets to.
const FIRST: u64 = 1 << 63;
/// The search is never given up altogether where branches cannot be ruled out: that would be biased.
const LEAST: f64 = 1.0 / 16.0;

/// The probability with which to search for further branches: the share of searches that find one in
/// a few samples of the scene, within bounds. These samples are not part of the image, so that the
/// choice does not bias it.
pub(super) fn search_probability(source: &Source) -> f64 {
    if source.scene.is_straight() {
        return 1.0;
    }
    let spec = source.scene.film();
    let pixels = spec.width * spec.height;
    let mut ws = source.workspace();
    let mut found = Vec::new();
    for i in 0..SAMPLES {
        // Multiples of the golden ratio spread evenly.
        let place = (0.618_033_988_749_894_9 * i as f64).fract();
        let pixel = (place * pixels as f64) as usize;
        source.sample(pixel.min(pixels - 1), FIRST + i as u64, &mut ws, &mut found);
        found.clear();
    }
    let counts = ws.stats.connections;
    let yields = counts.secondary as f64 / counts.searches.max(1) as f64;
    yields.clamp(LEAST, 1.0)
}
