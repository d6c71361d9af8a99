//! Options for reading volume files.

use super::AxisOrder;
use crate::error::Problem;
use crate::input::Limits;

/// Options for files whose format leaves properties undetermined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options<'a> {
    /// Order of axes.
    pub axes: Option<AxisOrder>,
    /// Path or name of the array to read, if there are several.
    pub dataset: Option<&'a str>,
    /// Limits of memory for the file.
    pub limits: Limits,
}

impl<'a> Options<'a> {
    /// Makes options for a file of one array with a given order of axes.
    pub fn order(axes: AxisOrder) -> Self {
        Options {
            axes: Some(axes),
            ..Options::default()
        }
    }

    /// Selects one of several arrays.
    #[must_use]
    pub fn of(self, dataset: &'a str) -> Self {
        Options {
            dataset: Some(dataset),
            ..self
        }
    }

    /// Sets the limits of memory.
    #[must_use]
    pub fn within(self, limits: Limits) -> Self {
        Options { limits, ..self }
    }

    /// Returns the order of axes, which must be given.
    pub(super) fn axes(&self) -> Result<AxisOrder, Problem> {
        let message = "it does not state the order of its axes: give the order of its axes (--axes, or axis_order in a scene), zyx if the last index runs along x, xyz if the first index does";
        self.axes.ok_or(Problem::Unsaid(message.into()))
    }
}

/// Returns the index of the requested array.
pub(super) fn choose(names: &[&str], name: Option<&str>) -> Result<usize, Problem> {
    let wanted = |i: &usize| name.is_none_or(|name| name == names[*i]);
    let wanted: Vec<usize> = (0..names.len()).filter(wanted).collect();
    if let [one] = wanted[..] {
        return Ok(one);
    }
    Err(Problem::Mismatch {
        expected: match name {
            Some(name) => format!("one array '{name}'"),
            None => "one array, or its name (--dataset, or 'dataset' in a scene)".into(),
        },
        found: if names.is_empty() {
            "none".into()
        } else {
            format!("the arrays: {}", names.join(", "))
        },
    })
}
