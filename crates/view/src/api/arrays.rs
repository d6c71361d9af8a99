//! Arrays of any number of axes, such as readings of meters, as lines and slices.

use super::{Failure, bad, not_found};
use crate::server::{Request, Response};
use io::arrays::{Array, Arrays};
use serde_json::{Value, json};
use std::ops::Range;

/// Describes names, axes and units, without the values.
pub(super) fn describe(arrays: &Arrays) -> Value {
    let array = |array: &Array| {
        json!({
            "name": array.name,
            "axes": array.axes,
            "shape": array.shape,
            "unit": array.unit,
        })
    };
    let attributes = arrays
        .attributes
        .iter()
        .map(|(name, value)| json!([name, value]));
    json!({
        "arrays": arrays.list.iter().map(array).collect::<Vec<_>>(),
        "attributes": attributes.collect::<Vec<_>>(),
        "left_out": arrays.left_out,
    })
}

/// Responds with a part of the array `name`. `part` has a selector for each axis, separated by
/// commas: the number of an element, `*` for all elements, or `sum` for their sum. Values are
/// ordered along the axes with `*`, the last one fastest.
pub(super) fn answer(arrays: &Arrays, request: &Request) -> Result<Response, Failure> {
    let name = request.parameter("name");
    let array = arrays.list.iter().find(|array| array.name == name);
    let array = array.ok_or_else(|| not_found("array"))?;
    let part = request.parameter("part");
    let selectors: Vec<&str> = match part {
        "" => Vec::new(),
        _ => part.split(',').collect(),
    };
    if selectors.len() != array.shape.len() {
        return Err(bad(format!("the array has {} axes", array.shape.len())));
    }
    let axes = selectors.iter().zip(&array.shape);
    let axes: Result<Vec<Selection>, Failure> = axes.map(|(s, n)| Selection::of(s, *n)).collect();
    Ok(Response::floats(select(array, &axes?)))
}

/// Selection along an axis.
struct Selection {
    elements: Range<usize>,
    is_kept: bool,
}

impl Selection {
    fn of(text: &str, length: usize) -> Result<Self, Failure> {
        let (elements, is_kept) = match text {
            "*" => (0..length, true),
            "sum" => (0..length, false),
            number => match number.parse() {
                Ok(i) if i < length => (i..i + 1, false),
                _ => {
                    return Err(bad(format!(
                        "'{number}' is no element of an axis of {length}"
                    )));
                }
            },
        };
        Ok(Selection { elements, is_kept })
    }
}

/// Adds up the selected elements over the axes that are not kept.
fn select(array: &Array, axes: &[Selection]) -> Vec<f32> {
    let kept = axes.iter().filter(|axis| axis.is_kept);
    let mut sums = vec![0.0f64; kept.map(|axis| axis.elements.len()).product()];
    add(array, axes, [0, 0], &mut sums);
    sums.into_iter().map(|v| v as f32).collect()
}

/// Adds up from an element of the array to an element of the result, along the remaining axes.
fn add(array: &Array, axes: &[Selection], [from, to]: [usize; 2], sums: &mut [f64]) {
    let Some((axis, rest)) = axes.split_first() else {
        sums[to] += array.data[from];
        return;
    };
    let length = array.shape[array.shape.len() - axes.len()];
    for i in axis.elements.clone() {
        let to = if axis.is_kept { to * length + i } else { to };
        add(array, rest, [from * length + i, to], sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn selected(part: &[&str]) -> Vec<f32> {
        let array = Array {
            name: "a".into(),
            axes: ["x", "y", "z"].map(str::to_owned).to_vec(),
            shape: vec![2, 3, 4],
            unit: String::new(),
            data: (0..24).map(f64::from).collect(),
        };
        let axes = part.iter().zip(&array.shape);
        let axes: Vec<Selection> = axes
            .map(|(s, n)| Selection::of(s, *n).ok().unwrap())
            .collect();
        select(&array, &axes)
    }

    #[test]
    fn slices_lines_and_sums() {
        assert_eq!(selected(&["1", "2", "3"]), [23.0]);
        assert_eq!(selected(&["*", "1", "0"]), [4.0, 16.0]);
        assert_eq!(selected(&["1", "*", "2"]), [14.0, 18.0, 22.0]);
        assert_eq!(
            selected(&["*", "*", "3"]),
            [3.0, 7.0, 11.0, 15.0, 19.0, 23.0]
        );
        assert_eq!(selected(&["0", "sum", "*"]), [12.0, 15.0, 18.0, 21.0]);
        assert_eq!(selected(&["sum", "sum", "sum"]), [276.0]);
    }

    #[test]
    fn only_elements_that_there_are() {
        for wrong in ["4", "-1", "", "x", "1.0", "99999999999999999999"] {
            assert!(Selection::of(wrong, 4).is_err(), "{wrong}");
        }
    }
}
