//! Splines of complex values (docs/theory.md#tagged-light).
//!
//! The real and imaginary parts of a coefficient are adjacent, so that a vector holds a row of four
//! coefficients. Sums are in single precision: these values do not guide rays, but are integrated.
//! Results are bit-identical on all processors that fuse products and sums, like in `evaluate.rs`.

use super::lattice::{Lattice, Layout};
use super::{Bspline, weights};
use crate::lanes::Summand;
use fearless_simd::{Level, Simd, SimdBase, dispatch, f32x4, f32x8};
use glam::{DVec2, DVec3};

/// Number of values in a row: four coefficients, each with a real and an imaginary part.
const ROW: usize = 8;

/// Coefficients of 1, t, t², t³ of the basis functions, and of their first derivatives, in single
/// precision.
const VALUE: [[f32; 4]; 4] = single(&weights::VALUE);
const FIRST_DERIVATIVE: [[f32; 4]; 3] = single(&weights::FIRST_DERIVATIVE);

/// A tricubic B-spline of complex values.
#[derive(Clone, Debug)]
pub(in crate::field) struct ComplexBspline {
    lattice: Lattice,
    /// Pairs of real and imaginary parts, in the order of the lattice.
    coefficients: Vec<f32>,
    level: Level,
}

/// Sums over the rows of each plane.
type Planes<S> = [f32x8<S>; 4];

impl ComplexBspline {
    /// Creates the spline of `scale` times the excess of two splines on one lattice over `level`. A
    /// part without a spline is zero; `None` without any spline.
    pub(in crate::field) fn above(
        level: f64,
        parts: [Option<Bspline>; 2],
        scale: f64,
    ) -> Option<Self> {
        let any = parts.iter().flatten().next()?;
        let mut coefficients = vec![0.0; 2 * any.coefficients.len()];
        for (at, part) in parts.iter().enumerate() {
            let Some(part) = part else { continue };
            // Add the constant to every coefficient: basis functions add up to one.
            let constant = part.n2_ref - level;
            let places = coefficients[at..].iter_mut().step_by(2);
            for (place, c) in places.zip(part.coefficients.iter()) {
                *place = (scale * (constant + f64::from(*c))) as f32;
            }
        }
        Some(ComplexBspline {
            lattice: any.lattice.clone(),
            coefficients,
            level: any.level,
        })
    }

    pub(in crate::field) fn memory(&self) -> usize {
        size_of_val(self.coefficients.as_slice())
    }

    pub(in crate::field) fn value(&self, x: DVec3) -> DVec2 {
        dispatch!(self.level, simd => self.value_by(simd, x))
    }

    /// Returns the value, and the gradients of both parts.
    pub(in crate::field) fn gradient(&self, x: DVec3) -> (DVec2, [DVec3; 2]) {
        dispatch!(self.level, simd => self.gradient_by(simd, x))
    }

    #[inline(always)]
    fn value_by<S: Simd>(&self, simd: S, x: DVec3) -> DVec2 {
        let (first, t) = self.lattice.locate(x);
        let [planes] = self.along_y(simd, first, [value_weights(simd, t.y)]);
        let sum = combined(&planes, value_weights(simd, t.z));
        across(sum * twice(simd, value_weights(simd, t.x)))
    }

    #[inline(always)]
    fn gradient_by<S: Simd>(&self, simd: S, x: DVec3) -> (DVec2, [DVec3; 2]) {
        let (first, t) = self.lattice.locate(x);
        let (y, z) = (value_weights(simd, t.y), value_weights(simd, t.z));
        let [value, first] = self.along_y(simd, first, [y, first_weights(simd, t.y)]);
        let x = twice(simd, value_weights(simd, t.x));
        let sum = combined(&value, z);
        let n2 = across(sum * x);
        let by_x = across(sum * twice(simd, first_weights(simd, t.x)));
        let by_y = across(combined(&first, z) * x);
        let by_z = across(combined(&value, first_weights(simd, t.z)) * x);
        let scale = self.lattice.per_spacing();
        let re = DVec3::new(by_x.x, by_y.x, by_z.x) * scale;
        let im = DVec3::new(by_x.y, by_y.y, by_z.y) * scale;
        (n2, [re, im])
    }

    /// Returns sums over the rows of each plane of coefficients, starting at `first`, with several
    /// weights of rows.
    #[inline(always)]
    fn along_y<S: Simd, const N: usize>(
        &self,
        simd: S,
        first: [isize; 3],
        weights: [f32x4<S>; N],
    ) -> [Planes<S>; N] {
        let gathered;
        let (from, strides) = if self.lattice.inside(first) && self.lattice.layout() == Layout::Rows
        {
            let start = 2 * self.lattice.offset(first.map(|i| i as usize));
            let [_, row, plane] = self.lattice.strides();
            (&self.coefficients[start..], [2 * row, 2 * plane])
        } else {
            gathered = self.gather(first);
            (&gathered[..], [ROW, 4 * ROW])
        };
        along_rows(simd, from, strides.map(|stride| stride as u32), weights)
    }

    /// Gathers coefficients from columns, or near the ends of the lattice, where the outermost
    /// coefficients replace all coefficients beyond.
    #[cold]
    #[inline(never)]
    fn gather(&self, first: [isize; 3]) -> [f32; 16 * ROW] {
        let mut gathered = [0.0; 16 * ROW];
        let places = |a: usize| {
            let stored = |i: usize| self.lattice.clamp(a, first[a] + i as isize);
            std::array::from_fn(|i| self.lattice.place(a, stored(i)))
        };
        let [x, y, z]: [[usize; 4]; 3] = std::array::from_fn(places);
        for (at, to) in gathered.chunks_exact_mut(2).enumerate() {
            let place = 2 * (x[at % 4] + y[at / 4 % 4] + z[at / 16]);
            to.copy_from_slice(&self.coefficients[place..][..2]);
        }
        gathered
    }
}

/// Converts coefficients to single precision.
const fn single<const N: usize>(powers: &[[f64; 4]; N]) -> [[f32; 4]; N] {
    let mut found = [[0.0; 4]; N];
    let mut at = 0;
    while at < 4 * N {
        found[at / 4][at % 4] = powers[at / 4][at % 4] as f32;
        at += 1;
    }
    found
}

/// Loads the rows of a plane.
#[inline(always)]
fn load<S: Simd>(simd: S, from: &[f32], row: usize) -> [f32x8<S>; 4] {
    [
        f32x8::from_slice(simd, &from[..ROW]),
        f32x8::from_slice(simd, &from[row..row + ROW]),
        f32x8::from_slice(simd, &from[2 * row..2 * row + ROW]),
        f32x8::from_slice(simd, &from[3 * row..3 * row + ROW]),
    ]
}

/// Returns the basis functions at a fraction of a cell.
#[inline(always)]
fn value_weights<S: Simd>(simd: S, t: f64) -> f32x4<S> {
    let c = |c: &[f32; 4]| f32x4::from_slice(simd, c);
    let ([v0, v1, v2, v3], t) = (&VALUE, t as f32);
    c(v0).plus(t, c(v1).plus(t, c(v2).plus(t, c(v3))))
}

/// Returns the derivatives of the basis functions by the coordinate in cells.
#[inline(always)]
fn first_weights<S: Simd>(simd: S, t: f64) -> f32x4<S> {
    let c = |c: &[f32; 4]| f32x4::from_slice(simd, c);
    let ([f0, f1, f2], t) = (&FIRST_DERIVATIVE, t as f32);
    c(f0).plus(t, c(f1).plus(t, c(f2)))
}

/// Duplicates each weight for the real and the imaginary part.
#[inline(always)]
fn twice<S: Simd>(simd: S, weights: f32x4<S>) -> f32x8<S> {
    simd.combine_f32x4(weights.zip_low(weights), weights.zip_high(weights))
}

/// Sums the rows of each of four planes. Strides have 32 bits for the reason given in
/// `evaluate.rs`.
#[inline(always)]
fn along_rows<S: Simd, const N: usize>(
    simd: S,
    from: &[f32],
    strides: [u32; 2],
    weights: [f32x4<S>; N],
) -> [Planes<S>; N] {
    let [row, plane] = strides.map(|stride| stride as usize);
    let of_plane = 3 * row + ROW;
    let from = &from[..3 * plane + of_plane];
    let planes = [
        &from[..of_plane],
        &from[plane..plane + of_plane],
        &from[2 * plane..2 * plane + of_plane],
        &from[3 * plane..],
    ];
    let mut sums = [[f32x8::splat(simd, 0.0); 4]; N];
    for (z, plane) in planes.into_iter().enumerate() {
        let rows = load(simd, plane, row);
        for (sums, weights) in sums.iter_mut().zip(weights) {
            sums[z] = combined(&rows, weights);
        }
    }
    sums
}

#[inline(always)]
fn combined<S: Simd>([a, b, c, d]: &[f32x8<S>; 4], weights: f32x4<S>) -> f32x8<S> {
    let [s, t, u, v] = *weights;
    (*b * t).plus(s, *a) + (*d * v).plus(u, *c)
}

/// Sums the four values of each part.
#[inline(always)]
fn across<S: Simd>(row: f32x8<S>) -> DVec2 {
    let [a, b, c, d, e, f, g, h] = *row;
    let (re, im) = ((a + c) + (e + g), (b + d) + (f + h));
    DVec2::new(f64::from(re), f64::from(im))
}

#[cfg(all(test, any(target_arch = "x86", target_arch = "x86_64")))]
mod tests {
    use super::*;
    use crate::Aabb;
    use crate::field::bspline::Sampling;

    const N2: f64 = 1.7;
    /// Largest error of single precision, relative to the largest coefficient: four roundings along
    /// each axis, of weights, products and two sums.
    const ROUNDING: f64 = 12.0 * 0.5 * f32::EPSILON as f64;

    /// Splines of two parts on a grid with sizes that are no multiples of columns.
    fn parts(layout: Layout) -> [Bspline; 2] {
        let cube = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let lattice = Lattice::new([9, 8, 7], cube, crate::field::Placement::Nodes);
        let lattice = lattice.unwrap().laid_out(layout);
        [0.0, 0.7].map(|phase| {
            let positions = lattice.clone();
            let wave = |x: DVec3| (3.0 * x.x + phase).sin() * (5.0 * x.y).cos() * (0.5 + x.z);
            let index = |at| (N2 + 0.5 * wave(positions.position(at))).sqrt();
            let sampling = Sampling {
                noise: 0.0,
                double: true,
            };
            Bspline::build(lattice.clone(), sampling, index).unwrap()
        })
    }

    fn complex(layout: Layout) -> ComplexBspline {
        ComplexBspline::above(N2, parts(layout).map(Some), 2.0).unwrap()
    }

    /// Places inside and outside the grid.
    fn places() -> impl Iterator<Item = DVec3> {
        let place = |i: u32| {
            let share = |s: f64| 3.0 * (s * f64::from(i) % 1.0) - 1.5;
            DVec3::new(share(0.754_877), share(0.569_840), share(0.438_579))
        };
        (0..2000).map(place)
    }

    fn values(spline: &ComplexBspline) -> Vec<f64> {
        let at = |x| {
            let (value, [re, im]) = spline.gradient(x);
            let all = [spline.value(x), value].map(|v| v.to_array());
            let gradients = [re, im].map(|g| g.to_array());
            [all.concat(), gradients.concat()].concat()
        };
        places().flat_map(at).collect()
    }

    #[test]
    fn values_are_those_of_both_splines() {
        let (parts, both) = (parts(Layout::Rows), complex(Layout::Rows));
        let largest = both
            .coefficients
            .iter()
            .fold(0.0_f32, |a, c| a.max(c.abs()));
        let least = ROUNDING * f64::from(largest);
        let spacings = both.lattice.per_spacing();
        for x in places() {
            let (value, gradients) = both.gradient(x);
            assert_eq!(value, both.value(x));
            for i in 0..2 {
                let (n2, gradient) = parts[i].gradient(x);
                assert!((value[i] - 2.0 * (n2 - N2)).abs() < least);
                let off = (gradients[i] - 2.0 * gradient) / spacings;
                // Double the error: the weights of derivatives are twice as large in sum.
                assert!(off.abs().max_element() < 2.0 * least, "{off}");
            }
        }
    }

    #[test]
    fn a_missing_part_is_zero() {
        let [re, im] = parts(Layout::Rows);
        for (i, parts) in [[None, Some(im)], [Some(re), None]].into_iter().enumerate() {
            let one = ComplexBspline::above(N2, parts, 2.0).unwrap();
            let both = complex(Layout::Rows);
            for x in places() {
                assert_eq!(one.value(x)[i], 0.0);
                assert_eq!(one.value(x)[1 - i], both.value(x)[1 - i]);
            }
        }
        assert!(ComplexBspline::above(N2, [None, None], 2.0).is_none());
    }

    #[test]
    fn neither_instructions_nor_the_order_in_memory_make_a_difference() {
        let spline = complex(Layout::Rows);
        assert_eq!(values(&complex(Layout::Columns)), values(&spline));
        // Double the error, because both values have it, and again for derivatives, per spacing.
        let largest = spline
            .coefficients
            .iter()
            .fold(0.0, |a, c| f32::max(a, c.abs()));
        let per_spacing = spline.lattice.per_spacing().max_element();
        let rounding = 2.0 * 2.0 * ROUNDING * f64::from(largest) * per_spacing;
        crate::lanes::assert_agree(rounding, |level| {
            let mut spline = spline.clone();
            spline.level = level;
            values(&spline)
        });
    }
}
