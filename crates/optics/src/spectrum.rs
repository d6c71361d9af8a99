//! Values per spectral channel.

use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Sub};

/// Values of up to four spectral channels that one path carries; unused channels are zero.
///
/// A film with more channels is rendered in groups of [`Spectrum::CHANNELS`]. Each group has its
/// own paths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spectrum(pub [f64; 4]);

impl From<f64> for Spectrum {
    /// Returns a spectrum with `value` in every channel.
    #[inline]
    fn from(value: f64) -> Self {
        Spectrum::splat(value)
    }
}

impl From<[f64; 3]> for Spectrum {
    /// Returns a spectrum of three channels.
    #[inline]
    fn from([r, g, b]: [f64; 3]) -> Self {
        Spectrum([r, g, b, 0.0])
    }
}

impl Spectrum {
    /// Number of channels that one path carries.
    pub const CHANNELS: usize = 4;
    /// Spectrum with 0 in every channel.
    pub const ZERO: Spectrum = Spectrum([0.0; 4]);
    /// Spectrum with 1 in every channel.
    pub const ONE: Spectrum = Spectrum([1.0; 4]);

    /// Returns a spectrum with `v` in every channel.
    #[inline]
    pub fn splat(v: f64) -> Self {
        Spectrum([v; 4])
    }

    /// Applies `f` to every channel.
    #[inline]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Spectrum(self.0.map(f))
    }

    /// Combines two spectra channel by channel.
    #[inline]
    pub fn zip(self, o: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Spectrum(std::array::from_fn(|i| f(self.0[i], o.0[i])))
    }

    /// Returns the largest value.
    #[inline]
    pub fn max(self) -> f64 {
        self.0.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the sum of the channels.
    #[inline]
    pub fn sum(self) -> f64 {
        self.0.into_iter().sum()
    }

    /// Returns true if every channel is zero.
    #[inline]
    pub fn is_zero(self) -> bool {
        self.0.iter().all(|&v| v == 0.0)
    }

    /// Returns true if more than one channel is positive.
    #[inline]
    pub fn is_several(self) -> bool {
        self.0.iter().filter(|v| **v > 0.0).count() > 1
    }

    /// Returns true if every channel is finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|v| v.is_finite())
    }

    /// Returns exp(−x) of each channel x.
    #[inline]
    pub fn exp_neg(self) -> Self {
        if self.is_zero() {
            return Spectrum::ONE;
        }
        // Compute the exponential once per run of equal values: most media are grey, and unused
        // channels are zero.
        let mut out = [(-self.0[0]).exp(); 4];
        for i in 1..4 {
            if self.0[i] != self.0[i - 1] {
                out[i] = if self.0[i] == 0.0 {
                    1.0
                } else {
                    (-self.0[i]).exp()
                };
            } else {
                out[i] = out[i - 1];
            }
        }
        Spectrum(out)
    }
}

impl Add for Spectrum {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        self.zip(o, |a, b| a + b)
    }
}

impl Sub for Spectrum {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        self.zip(o, |a, b| a - b)
    }
}

impl Mul for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        self.zip(o, |a, b| a * b)
    }
}

impl Mul<f64> for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, s: f64) -> Self {
        self.map(|v| v * s)
    }
}

impl Div<f64> for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, s: f64) -> Self {
        self.map(|v| v / s)
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        *self = *self * o;
    }
}

impl MulAssign<f64> for Spectrum {
    #[inline]
    fn mul_assign(&mut self, s: f64) {
        *self = *self * s;
    }
}

impl Index<usize> for Spectrum {
    type Output = f64;
    #[inline]
    fn index(&self, i: usize) -> &f64 {
        &self.0[i]
    }
}

impl IndexMut<usize> for Spectrum {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f64 {
        &mut self.0[i]
    }
}
