//! Pixels to which a point of the image contributes.

use super::Filter;

/// Passes to `count` each pixel whose filter covers a position, with the filter's value there, per
/// pixel. The position is in pixels from the top left corner of a `width × height` image. The
/// values are those that camera samples at this position represent ([`Filter::sample`],
/// [`Filter::weight`]).
///
/// Keep these loops: Rust 1.95 compiled an iterator in their place wrongly where it was inlined in
/// release builds. Values then went to the pixels of the next row. `scripts/same_bits.py` detects
/// this.
pub(crate) fn footprint(
    width: usize,
    height: usize,
    filter: &Filter,
    [x, y]: [f64; 2],
    mut count: impl FnMut(usize, f64),
) {
    let columns = reach(x, width, filter.radius());
    for row in reach(y, height, filter.radius()) {
        let vertical = filter.value(y - (row as f64 + 0.5));
        for column in columns.clone() {
            let value = vertical * filter.value(x - (column as f64 + 0.5));
            if value != 0.0 {
                count(row * width + column, value);
            }
        }
    }
}

/// Returns the pixels along one axis whose centres are no farther than `radius` from a position.
fn reach(position: f64, size: usize, radius: f64) -> std::ops::Range<usize> {
    let clamp = |v: f64| v.clamp(0.0, size as f64) as usize;
    clamp((position - 0.5 - radius).floor())..clamp((position - 0.5 + radius).floor() + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Footprint of `place`, which is in units of the image.
    fn pixels([width, height]: [usize; 2], filter: Filter, place: [f64; 2]) -> Vec<(usize, f64)> {
        let mut found = Vec::new();
        let place = [place[0] * width as f64, place[1] * height as f64];
        footprint(width, height, &filter, place, |pixel, value| {
            found.push((pixel, value));
        });
        found
    }

    #[test]
    fn a_box_is_one_pixel() {
        let at = |s, t| pixels([4, 2], Filter::Box, [s, t]);
        assert_eq!(at(0.0, 0.0), [(0, 1.0)]);
        assert_eq!(at(0.25, 0.0), [(1, 1.0)]);
        assert_eq!(at(0.999, 0.999), [(7, 1.0)]);
        for outside in [-1e-9, 1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(at(outside, 0.5), []);
        }
    }

    #[test]
    fn wide_filters_reach_neighbours() {
        let filter = Filter::Gaussian { stddev: 0.5 };
        // The values of a footprint add up to one on average over positions within a pixel.
        let place = |i: usize| (32.0 + (i as f64 + 0.5) / 8.0) / 64.0;
        let at = |i: usize| pixels([64, 64], filter, [place(i % 8), place(i / 8)]);
        let mean: f64 = (0..64).flat_map(at).map(|p| p.1).sum::<f64>() / 64.0;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
        let beyond = pixels([64, 64], filter, [-0.5 / 64.0, 0.5]);
        assert!(!beyond.is_empty());
    }
}
