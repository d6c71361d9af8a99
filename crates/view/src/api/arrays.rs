//! Arrays of any number of axes, such as readings of meters, as lines and slices.

use super::{Failure, bad, not_found};
use crate::server::{Request, Response};
use io::arrays::{Array, Arrays};
use serde_json::{Value, json};
use std::ops::Range;

/// Number of elements, evenly spread, from which quantiles are determined.
const SAMPLED: usize = 100_000;
/// Quantiles between which nearly all elements lie.
const NEARLY_ALL: [f64; 2] = [0.002, 0.998];
/// Quantile of the positive elements from which a logarithmic scale begins.
const DARK: f64 = 0.01;

/// Describes names, axes with their edges and units, without the values.
pub(super) fn describe(arrays: &Arrays) -> Value {
    let array = |array: &Array| {
        let edges = array.axes.iter().map(|axis| arrays.edges(array, axis));
        json!({
            "name": array.name,
            "axes": array.axes,
            "shape": array.shape,
            "unit": array.unit,
            "has_edges": edges.map(|edges| edges.is_some()).collect::<Vec<_>>(),
            "metres_per_unit": arrays.metres_per_unit(array),
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

fn named<'a>(arrays: &'a Arrays, request: &Request) -> Result<&'a Array, Failure> {
    let name = request.parameter("name");
    let array = arrays.list.iter().find(|array| array.name == name);
    array.ok_or_else(|| not_found("array"))
}

/// Responds with the edges of the bins of array `name` along `axis`.
pub(super) fn edges(arrays: &Arrays, request: &Request) -> Result<Response, Failure> {
    let array = named(arrays, request)?;
    let edges = arrays.edges(array, request.parameter("axis"));
    let edges = edges.ok_or_else(|| not_found("edges"))?;
    Ok(super::json_response(&json!(edges)))
}

/// Responds with the range of array `name`: the indices of its largest element, the smallest and the
/// largest value, limits of nearly all values, and limits and median of the positive ones. Values
/// that are not finite do not count; all are null if none is finite.
pub(super) fn range(arrays: &Arrays, request: &Request) -> Result<Response, Failure> {
    let array = named(arrays, request)?;
    let finite = || array.data.iter().enumerate().filter(|(_, v)| v.is_finite());
    let peak = finite().max_by(|a, b| a.1.total_cmp(b.1));
    let least = finite().map(|(_, v)| *v).min_by(f64::total_cmp);
    let step = array.data.len().div_ceil(SAMPLED).max(1);
    let some = |is_wanted: fn(f64) -> bool| {
        let some = array.data.iter().step_by(step).copied();
        let mut some: Vec<f64> = some.filter(|v| v.is_finite() && is_wanted(*v)).collect();
        some.sort_by(f64::total_cmp);
        some
    };
    let (all, positive) = (some(|_| true), some(|v| v > 0.0));
    let lit = [DARK, 0.5].map(|share| quantile(&positive, share));
    Ok(super::json_response(&json!({
        "peak": peak.map(|(i, _)| indices(i, &array.shape)),
        "least": least,
        "most": peak.map(|(_, v)| v),
        "nearly_all": NEARLY_ALL.map(|share| quantile(&all, share)),
        "positive": lit,
    })))
}

/// Returns the indices of an element along all axes.
fn indices(element: usize, shape: &[usize]) -> Vec<usize> {
    let mut rest = element;
    let mut indices = vec![0; shape.len()];
    for (index, length) in indices.iter_mut().zip(shape).rev() {
        (*index, rest) = (rest % length, rest / length);
    }
    indices
}

fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    Some(sorted[(share * last as f64).round() as usize])
}

/// Responds with a part of the array `name`. `part` has a selector for each axis, separated by
/// commas: the number of an element, `*` for all elements, or `sum` for their sum. Values are
/// ordered along the axes with `*`, the last one fastest.
pub(super) fn answer(arrays: &Arrays, request: &Request) -> Result<Response, Failure> {
    let array = named(arrays, request)?;
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
    fn indices_run_fastest_along_the_last_axis() {
        assert_eq!(indices(23, &[2, 3, 4]), [1, 2, 3]);
        assert_eq!(indices(5, &[2, 3, 4]), [0, 1, 1]);
        assert!(indices(0, &[]).is_empty());
    }

    #[test]
    fn only_elements_that_there_are() {
        for wrong in ["4", "-1", "", "x", "1.0", "99999999999999999999"] {
            assert!(Selection::of(wrong, 4).is_err(), "{wrong}");
        }
    }
}
