//! Order of an array's elements, and of a volume's elements.

use super::Sample;
use crate::binary;
use crate::element::Encoding;
use crate::error::Problem;
use crate::input::Limits;
use eikonal::field::Bspline;
use std::fmt;
use std::io::Read;
use std::ops::Range;
use std::str::FromStr;

/// Assignment of the axes of space to the axes of an array: a letter for each axis, in the order of
/// the array's indices; `c` is the axis of the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisOrder {
    letters: [char; 4],
    /// True if the channels were named. Otherwise, an array of four axes has them last.
    channels: bool,
}

impl AxisOrder {
    /// Order of `array[z, y, x]`, as in Mitsuba and k-Wave.
    pub const ZYX: AxisOrder = AxisOrder {
        letters: ['z', 'y', 'x', 'c'],
        channels: false,
    };
    /// Order of `array[x, y, z]`.
    pub const XYZ: AxisOrder = AxisOrder {
        letters: ['x', 'y', 'z', 'c'],
        channels: false,
    };

    /// Order of `array[c, z, y, x]`, with the channels, or the time, first.
    pub(super) const CZYX: AxisOrder = AxisOrder {
        letters: ['c', 'z', 'y', 'x'],
        channels: true,
    };

    /// Returns the letters of an array of `axes` axes.
    fn of(&self, axes: usize) -> Option<&[char]> {
        match (axes, self.channels) {
            (4, _) => Some(&self.letters),
            (3, false) => Some(&self.letters[..3]),
            _ => None,
        }
    }
}

impl FromStr for AxisOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut letters: Vec<char> = text.chars().collect();
        let channels = letters.len() == 4;
        if letters.len() == 3 {
            letters.push('c');
        }
        let mut sorted = letters.clone();
        sorted.sort_unstable();
        match (<[char; 4]>::try_from(letters), &sorted[..]) {
            (Ok(letters), ['c', 'x', 'y', 'z']) => Ok(AxisOrder { letters, channels }),
            _ => Err(format!(
                "'{text}' is not an order of axes: give the letters x, y, z, in the order of the array's indices, \
                 for example zyx; with c where the channels are, for example czyx"
            )),
        }
    }
}

impl fmt::Display for AxisOrder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = if self.channels { 4 } else { 3 };
        self.letters[..shown]
            .iter()
            .try_for_each(|c| write!(f, "{c}"))
    }
}

/// Size of a volume, and the order of its values in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub size: [usize; 3],
    pub channels: usize,
    /// Length of each axis, and the distance of neighbours in the volume; the slowest axis of the
    /// file first.
    axes: [(usize, usize); 4],
}

impl Layout {
    /// Makes the layout of an array, whose first index varies fastest if `fortran`.
    pub(super) fn new(shape: &[usize], fortran: bool, order: AxisOrder) -> Result<Self, Problem> {
        let Some(letters) = order.of(shape.len()) else {
            let expected = if order.channels {
                format!("an array of 4 axes ({order})")
            } else {
                "an array of 3 axes, or 4 with the channels last".to_owned()
            };
            let empty = if shape.contains(&0) { "empty " } else { "" };
            let found = format!("an {empty}array of shape {shape:?}");
            return Err(Problem::Mismatch { expected, found });
        };
        let length = |letter| {
            let found = letters.iter().position(|l| *l == letter);
            found.map_or(1, |i| shape[i])
        };
        let (size, channels) = (['x', 'y', 'z'].map(length), length('c'));
        check(size, channels)?;
        let stride = |letter| match letter {
            'c' => 1,
            'x' => channels,
            'y' => channels * size[0],
            _ => channels * size[0] * size[1],
        };
        let mut axes = order.letters.map(|letter| (length(letter), stride(letter)));
        if fortran {
            axes.reverse();
        }
        Ok(Layout {
            size,
            channels,
            axes,
        })
    }

    /// Makes the layout of a volume: channels are adjacent, then x is fastest.
    pub(super) fn plain(size: [usize; 3], channels: usize) -> Result<Self, Problem> {
        let [x, y, z] = size;
        Self::new(&[z, y, x, channels], false, AxisOrder::ZYX)
    }

    /// Makes the layout of an array `[frame, place]`. A place is a sample of a volume, with x
    /// fastest.
    pub(super) fn columns(size: [usize; 3], frames: usize) -> Result<Self, Problem> {
        check(size, frames)?;
        let places = size.iter().product();
        Ok(Layout {
            size,
            channels: frames,
            axes: [(1, 0), (1, 0), (frames, 1), (places, frames)],
        })
    }

    /// Yields axes of more than one element, the slowest axis of the file first: their lengths, and
    /// the distances of neighbours in the volume.
    pub(super) fn long_axes(&self) -> impl Iterator<Item = (usize, usize)> {
        self.axes.into_iter().filter(|(length, _)| *length > 1)
    }

    /// Returns the range of the values in the file that contains some channels: whole rows of the
    /// slowest axis.
    pub(super) fn span(&self, channels: Range<usize>) -> Range<usize> {
        match self.long_axes().next() {
            Some((length, 1)) if length == self.channels => {
                let row = self.count() / length;
                channels.start * row..channels.end * row
            }
            _ => 0..self.count(),
        }
    }

    /// Returns the number of values.
    pub(super) fn count(&self) -> usize {
        self.axes.iter().map(|(length, _)| length).product()
    }

    /// Checks that a file of `size` bytes may take memory for the values.
    pub(super) fn check<T: Sample>(&self, limits: Limits, size: u64) -> Result<(), Problem> {
        limits.check(self.count() as u64, size_of::<T>() as u64, size)
    }

    /// Returns the capacity for the values, and for a spline through them that is computed in
    /// place.
    fn room(&self) -> usize {
        match self.channels {
            1 => Bspline::room(self.size).max(self.count()),
            _ => self.count(),
        }
    }

    /// Returns zeros for all values, with [`Self::room`]. The caller has checked the memory.
    pub(super) fn zeros<T: Sample>(&self) -> Vec<T> {
        let mut data = Vec::with_capacity(self.room());
        data.resize(self.count(), T::nearest(0.0));
        data
    }

    /// Reads values. The caller has checked the memory.
    pub(super) fn read<T: Sample>(
        &self,
        reader: &mut impl Read,
        encoding: Encoding,
    ) -> Result<Vec<T>, Problem> {
        let count = self.count();
        let mut data = Vec::with_capacity(self.room());
        let read = if self.is_in_order() {
            encoding.read(reader, count, |v| data.push(T::nearest(v)))
        } else {
            data.resize(count, T::nearest(0.0));
            let mut targets = self.targets();
            encoding.read(reader, count, |v| {
                if let Some(i) = targets.next() {
                    data[i] = T::nearest(v);
                }
            })
        };
        read.map_err(Problem::Read)?;
        Ok(data)
    }

    /// Parses values from text, separated by blanks.
    pub(super) fn parse<T: Sample>(&self, text: &str) -> Result<Vec<T>, Problem> {
        // Check the number of values: each takes at least a byte and a blank.
        if self.count() > text.len().div_ceil(2) {
            return Err(self.other_count(text.split_ascii_whitespace().count()));
        }
        let mut data = vec![T::nearest(0.0); self.count()];
        let mut words = text.split_ascii_whitespace();
        for (target, word) in self.targets().zip(&mut words) {
            let bad = |_| Problem::Malformed(format!("'{word}' is not a number"));
            data[target] = T::nearest(word.parse().map_err(bad)?);
        }
        match text.split_ascii_whitespace().count() {
            n if n == self.count() => Ok(data),
            n => Err(self.other_count(n)),
        }
    }

    fn other_count(&self, found: usize) -> Problem {
        Problem::Mismatch {
            expected: format!("{} values", self.count()),
            found: found.to_string(),
        }
    }

    /// Returns true if the values in the file have the order of the volume.
    fn is_in_order(&self) -> bool {
        let mut expected = 1;
        self.axes.iter().rev().all(|&(length, distance)| {
            let fits = length == 1 || distance == expected;
            expected *= length;
            fits
        })
    }

    /// Yields the positions in the volume of the values of the file, in the order of the file.
    pub(super) fn targets(&self) -> impl Iterator<Item = usize> + use<> {
        self.targets_from(0)
    }

    /// Yields the positions in the volume from a row of the fastest axis onwards; `first` is the
    /// number of its first value.
    pub(super) fn targets_from(&self, first: usize) -> impl Iterator<Item = usize> + use<> {
        let [(a, da), (b, db), (c, dc), (d, dd)] = self.axes;
        (first / d..a * b * c).flat_map(move |row| {
            let [i, j, k] = [row / c / b, row / c % b, row % c];
            let start = i * da + j * db + k * dc;
            (0..d).map(move |l| start + l * dd)
        })
    }
}

/// Checks that sizes are not zero, and that the number of values is within memory.
pub(super) fn check(size: [usize; 3], channels: usize) -> Result<usize, Problem> {
    let sizes = || format!("{} voxels with {channels} channels", binary::product(&size));
    if channels == 0 || size.contains(&0) {
        return Err(Problem::Empty(sizes()));
    }
    let count = size.iter().try_fold(channels, |n, m| n.checked_mul(*m));
    let count = count.filter(|n| n.checked_mul(size_of::<f64>()).is_some());
    count.ok_or_else(|| Problem::TooLarge(sizes()))
}
