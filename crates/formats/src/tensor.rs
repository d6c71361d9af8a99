//! Arrays of numbers that a scene contains, instead of a file.

use crate::error::Problem;

/// Array of numbers with any number of axes; the last axis varies fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    numbers: Numbers,
    is_complex: bool,
}

/// Numbers of a [`Tensor`].
#[derive(Clone, Debug, PartialEq)]
pub enum Numbers {
    /// Numbers in single precision.
    Single(Vec<f32>),
    /// Numbers in double precision, including integers.
    Double(Vec<f64>),
}

impl Tensor {
    /// Makes an array.
    ///
    /// # Errors
    /// A shape that does not match the numbers.
    pub fn new(shape: Vec<usize>, numbers: Numbers) -> Result<Self, Problem> {
        let found = match &numbers {
            Numbers::Single(v) => v.len(),
            Numbers::Double(v) => v.len(),
        };
        let expected = shape.iter().try_fold(1usize, |n, m| n.checked_mul(*m));
        if expected == Some(found) {
            Ok(Tensor {
                shape,
                numbers,
                is_complex: false,
            })
        } else {
            Err(Problem::Mismatch {
                expected: format!("an array of shape {shape:?}"),
                found: format!("{found} numbers"),
            })
        }
    }

    /// Marks the last axis as real and imaginary parts of complex numbers.
    #[must_use]
    pub fn of_complex_numbers(self) -> Self {
        Tensor {
            is_complex: true,
            ..self
        }
    }

    /// Returns true if the last axis has the real and imaginary parts of complex numbers.
    pub fn is_complex(&self) -> bool {
        self.is_complex
    }

    /// Returns the length of each axis.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Returns the numbers as stored.
    pub fn numbers(&self) -> &Numbers {
        &self.numbers
    }

    /// Returns the number at an index in memory; `i` must be less than [`Tensor::len`].
    pub fn get(&self, i: usize) -> f64 {
        match &self.numbers {
            Numbers::Single(v) => f64::from(v[i]),
            Numbers::Double(v) => v[i],
        }
    }

    /// Yields all numbers, the last axis fastest.
    pub fn iter(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.len()).map(|i| self.get(i))
    }

    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        match &self.numbers {
            Numbers::Single(v) => v.len(),
            Numbers::Double(v) => v.len(),
        }
    }

    /// Returns true if there are no elements.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the rows of a table with `N` columns.
    ///
    /// # Errors
    /// Another shape, and NaN or infinite numbers.
    pub fn rows<const N: usize>(&self) -> Result<Vec<[f64; N]>, Problem> {
        let [_, columns] = self.shape[..] else {
            return Err(self.no_table(N));
        };
        if columns != N {
            return Err(self.no_table(N));
        }
        let numbers: Vec<f64> = self.iter().collect();
        if let Some(i) = numbers.iter().position(|v| !v.is_finite()) {
            return Err(Problem::NotFinite {
                place: format!("[{}, {}]", i / N, i % N),
                value: numbers[i],
            });
        }
        let (rows, _) = numbers.as_chunks();
        Ok(rows.to_vec())
    }

    fn no_table(&self, columns: usize) -> Problem {
        Problem::Mismatch {
            expected: format!("an array of shape (n, {columns})"),
            found: format!("shape {:?}", self.shape),
        }
    }
}
