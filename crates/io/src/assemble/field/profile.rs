//! Indices given by a table over one coordinate.

use crate::query::Query;
use crate::scene::FileRegistry;
use crate::table;
use eikonal::Field;
use eikonal::field::{Coordinate, FieldError, IndexProfile};
use glam::{DAffine3, DVec3};

/// Half size of the box of a table along axes on which the index does not depend.
const HALF_SIZE: f64 = 1e100;

/// Builds the field of a volume of type `profile`; `None` after an error. Also returns the map from
/// the unit cube to the box that the samples cover.
pub(super) fn build(
    q: &mut Query,
    files: &mut FileRegistry,
) -> Option<(Result<Field, FieldError>, DAffine3)> {
    let coordinate = coordinate(q);
    let shift = q.float("shift");
    let samples = samples(q, files)?;
    let coordinate = coordinate?;
    let ends = [samples.first(), samples.last()].map(|end| end.map_or(0.0, |[u, _]| u + shift));
    let field = IndexProfile::table(coordinate, shift, &samples).map(Field::from);
    Some((field, extent(coordinate, ends)))
}

/// Returns the map from the unit cube to a box. In the box the coordinate varies from the first of
/// the `ends` to the last, or is a distance up to the last.
fn extent(coordinate: Coordinate, [first, last]: [f64; 2]) -> DAffine3 {
    let (low, high) = (DVec3::splat(-HALF_SIZE), DVec3::splat(HALF_SIZE));
    let (min, max) = match coordinate {
        Coordinate::R => (DVec3::splat(-last), DVec3::splat(last)),
        Coordinate::Rho => (
            DVec3::new(-last, -last, -HALF_SIZE),
            DVec3::new(last, last, HALF_SIZE),
        ),
        Coordinate::X => (low.with_x(first), high.with_x(last)),
        Coordinate::Y => (low.with_y(first), high.with_y(last)),
        Coordinate::Z => (low.with_z(first), high.with_z(last)),
    };
    DAffine3::from_translation(min) * DAffine3::from_scale(max - min)
}

/// Reads the coordinate of a profile; `None` after an error.
fn coordinate(q: &mut Query) -> Option<Coordinate> {
    if !q.has("coordinate") {
        let message = "a profile needs a 'coordinate' that the index varies with: \"r\", the distance from \
                       the origin, \"rho\", that from the z axis, \"x\", \"y\" or \"z\"";
        q.error("coordinate", message);
        return None;
    }
    let name = q.word("coordinate");
    let mut all = Coordinate::ALL.into_iter();
    all.find(|(known, _)| known == &name)
        .map(|(_, coordinate)| coordinate)
}

/// Reads the pairs of the table from the parameter `table`, `data` or `filename`.
fn samples(q: &mut Query, files: &mut FileRegistry) -> Option<Vec<[f64; 2]>> {
    let given = ["table", "data", "filename"].map(|name| q.has(name));
    match given {
        [true, false, false] => listed(q),
        [false, true, false] => held(q),
        [false, false, true] => {
            let path = q.path("filename", files);
            let read = (!path.as_os_str().is_empty()).then(|| table::read(&path))?;
            read.map_err(|e| q.file_error("filename", &e)).ok()
        }
        _ => {
            let message = "a profile needs one of 'table', pairs of a coordinate and an index, 'data', the same as an \
                           array, and 'filename', a text file with two columns";
            q.error("table", message);
            None
        }
    }
}

/// Parses pairs of numbers from the text `table`.
fn listed(q: &mut Query) -> Option<Vec<[f64; 2]>> {
    let text = q.string("table");
    let words = text.split([',', ';', ' ', '\t', '\n', '\r']);
    let numbers = words.filter(|word| !word.is_empty()).map(str::parse);
    match numbers.collect::<Result<Vec<f64>, _>>() {
        Ok(numbers) if numbers.len() % 2 == 0 => {
            let pairs = numbers.chunks_exact(2);
            Some(pairs.map(|pair| [pair[0], pair[1]]).collect())
        }
        _ => {
            q.error(
                "table",
                "'table' is a list of pairs of numbers: coordinate, index, coordinate, index, ...",
            );
            None
        }
    }
}

/// Reads pairs of numbers from the array `data`.
fn held(q: &mut Query) -> Option<Vec<[f64; 2]>> {
    let rows = q.tensor("data")?.rows();
    rows.map_err(|e| q.error("data", e.to_string())).ok()
}
