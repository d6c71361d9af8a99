//! What a user has to say of a file.

use super::AxisOrder;
use crate::error::Problem;
use crate::input::Limits;

/// What a user has to say of a file whose format leaves it open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options<'a> {
    /// Which axis is which.
    pub axes: Option<AxisOrder>,
    /// Which of several arrays is meant: its path or name.
    pub dataset: Option<&'a str>,
    /// How much memory the file may take.
    pub limits: Limits,
}

impl<'a> Options<'a> {
    /// For a file of one array in a given order.
    pub fn order(axes: AxisOrder) -> Self {
        Options {
            axes: Some(axes),
            ..Options::default()
        }
    }

    /// The same for one of several arrays.
    #[must_use]
    pub fn of(self, dataset: &'a str) -> Self {
        Options {
            dataset: Some(dataset),
            ..self
        }
    }

    /// The same for files that may take so much memory.
    #[must_use]
    pub fn within(self, limits: Limits) -> Self {
        Options { limits, ..self }
    }

    /// The order of axes, which must be given.
    pub(super) fn axes(&self) -> Result<AxisOrder, Problem> {
        let message = "it does not say which axis is which: give the order of its axes (--axes, or axis_order in \
                       a scene), zyx if the last index runs along x, xyz if the first does";
        self.axes.ok_or(Problem::Unsaid(message.into()))
    }
}

/// Which of several arrays is meant.
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
