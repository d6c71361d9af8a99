//! Indices by a table of one coordinate.

use crate::query::Query;
use crate::scene::FileRegistry;
use crate::table;
use eikonal::Field;
use eikonal::field::{Coordinate, FieldError, IndexProfile};

/// Names of coordinates, in the order of the schema.
const NAMES: [&str; 5] = ["r", "rho", "x", "y", "z"];

/// The field of a volume of type `profile`; `None` after an error.
pub(super) fn build(q: &mut Query, files: &mut FileRegistry) -> Option<Result<Field, FieldError>> {
    let coordinate = coordinate(q);
    let shift = q.float_or("shift", 0.0);
    let samples = samples(q, files)?;
    Some(IndexProfile::table(coordinate?, shift, &samples).map(Field::from))
}

fn coordinate(q: &mut Query) -> Option<Coordinate> {
    if !q.has("coordinate") {
        let message = "a profile needs a 'coordinate' that the index varies with: \"r\", the distance from \
                       the origin, \"rho\", that from the z axis, \"x\", \"y\" or \"z\"";
        q.error("coordinate", message);
        return None;
    }
    let name = NAMES[q.one_of("coordinate", &NAMES)];
    let mut all = Coordinate::ALL.into_iter();
    all.find(|(known, _)| *known == name)
        .map(|(_, coordinate)| coordinate)
}

/// The pairs of the table, wherever it is.
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

fn held(q: &mut Query) -> Option<Vec<[f64; 2]>> {
    let rows = q.tensor("data")?.rows();
    rows.map_err(|e| q.error("data", e.to_string())).ok()
}
