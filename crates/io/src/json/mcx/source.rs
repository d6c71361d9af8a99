//! Sources as a file gives them.

use super::super::tree::Node;
use super::labels::Labels;
use super::rays::{self, Rays};
use super::{Place, Reader, field};
use glam::DVec3;

/// Displacement of sources in the volume, as a fraction of the way to the centre of their voxel.
/// MCX starts photons in this voxel.
const INWARD: f64 = 1e-4;

/// Largest number of beams of an array of pencil beams.
const MAX_BEAMS: f64 = 10_000.0;

/// A source of a file.
pub(super) struct Source {
    /// Position in voxels from the volume's corner, inside the voxel that contains it.
    pub position: DVec3,
    pub direction: DVec3,
    pub first: [f64; 4],
    pub second: [f64; 4],
    /// Weight of the source's photons.
    pub weight: f64,
    /// Directions of the light around `direction`.
    pub rays: Rays,
}

/// Returns the sources that a file selects by `ID`: all, or a single one, counted from 1.
pub(super) fn wanted(
    mut sources: Vec<Source>,
    node: &Node,
    reader: &mut Reader,
) -> Option<Vec<Source>> {
    let id = reader.number_or(node, "ID", 0.0);
    if id == 0.0 {
        return Some(sources);
    }
    if id.fract() != 0.0 || !(1.0..=sources.len() as f64).contains(&id) {
        let message = format!(
            "ID must be 0 for all sources together, or the number of a source from 1 to {}",
            sources.len()
        );
        reader.error(node, message);
        return None;
    }
    Some(vec![sources.swap_remove(id as usize - 1)])
}

impl Source {
    pub(super) fn all(
        node: &Node,
        place: &Place,
        labels: Option<&Labels>,
        reader: &mut Reader,
    ) -> Option<Vec<Self>> {
        let positions = reader.table(node, "Pos", 3)?;
        let directions = reader.directions(node, "Dir")?;
        let errors = reader.diagnostics.error_count();
        let angles = rays::by_quantiles(node, reader);
        if reader.diagnostics.error_count() > errors {
            return None;
        }
        let mut parameters = |key| {
            if field(node, key).is_some() {
                reader.table(node, key, 1)
            } else {
                Some(vec![Vec::new(); positions.len()])
            }
        };
        let (first, second) = (parameters("Param1")?, parameters("Param2")?);
        if [&directions, &first, &second]
            .iter()
            .any(|rows| rows.len() != positions.len())
        {
            let message = "Pos, Dir, Param1 and Param2 must have a row for each source";
            reader.error(node, message);
            return None;
        }
        let alone = (positions.len() == 1).then(|| reader.number_or(node, "Weight", 1.0));
        let mut sources = Vec::with_capacity(positions.len());
        for (i, position) in positions.iter().enumerate() {
            let place =
                DVec3::from_slice(&place.of([position[0], position[1], position[2]])) / place.unit;
            let weight = position.get(3).copied().or(alone).unwrap_or(1.0);
            let focus = directions[i].get(3).copied().unwrap_or(0.0);
            if angles.is_some() && focus != 0.0 {
                let message = "with AngleInverseCDF (angleinvcdf) the fourth number of Dir must be 0: angles between the given angles are \
                               interpolated";
                reader.error(node, message);
                return None;
            }
            let source = Source {
                position: inside(place, labels),
                direction: direction(&directions[i], node, reader)?,
                rays: angles.clone().unwrap_or_else(|| Rays::of_focus(focus)),
                first: four(&first[i]),
                second: four(&second[i]),
                weight,
            };
            if !(weight > 0.0 && weight.is_finite()) {
                reader.error(
                    node,
                    "the fourth number of Pos, the weight of a source, must be above 0",
                );
                return None;
            }
            sources.push(source);
        }
        Some(sources)
    }

    /// Returns the beams of an array of pencil beams. The fourth parameters are the numbers of beams
    /// along the sides, 0 standing for 1; the outermost beams are at the corners.
    pub(super) fn beams(&self, labels: Option<&Labels>) -> Result<Vec<Self>, String> {
        // SIMPA writes a single beam as an array without sides and numbers.
        let counts = [self.first[3], self.second[3]].map(|n| if n == 0.0 { 1.0 } else { n });
        let is_count = |n: f64| n.fract() == 0.0 && n >= 1.0;
        if !counts.into_iter().all(is_count) || counts[0] * counts[1] > MAX_BEAMS {
            return Err(format!(
                "the fourth numbers of Param1 and Param2 of a pencilarray must be numbers of beams, at most {MAX_BEAMS} in all"
            ));
        }
        let sides = self.sides();
        let at = |i: usize, k: usize| {
            let part = |i: usize, n: f64| i as f64 / (n - 1.0).max(1.0);
            self.position + part(i, counts[0]) * sides[0] + part(k, counts[1]) * sides[1]
        };
        let [across, up] = counts.map(|n| n as usize);
        let places = (0..across).flat_map(|i| (0..up).map(move |k| (i, k)));
        let beam = |(i, k)| Source {
            position: inside(at(i, k), labels),
            direction: self.direction,
            first: [0.0; 4],
            second: [0.0; 4],
            weight: self.weight / (counts[0] * counts[1]),
            rays: self.rays.clone(),
        };
        Ok(places.map(beam).collect())
    }

    /// Returns the sides of the parallelogram that the parameters span.
    pub(super) fn sides(&self) -> [DVec3; 2] {
        [self.first, self.second].map(|p| DVec3::new(p[0], p[1], p[2]))
    }
}

/// Moves a position slightly into its voxel, if the voxel has a medium.
fn inside(position: DVec3, labels: Option<&Labels>) -> DVec3 {
    if labels.is_some_and(|l| l.at(position.to_array()) > 0.0) {
        position.lerp(position.floor() + 0.5, INWARD)
    } else {
        position
    }
}

/// Returns a unit direction.
fn direction(row: &[f64], node: &Node, reader: &mut Reader) -> Option<DVec3> {
    let direction = DVec3::from_slice(&row[..3]).try_normalize();
    if direction.is_none() {
        reader.error(
            node,
            "Dir must be a direction: three numbers that are not all 0",
        );
    }
    direction
}

/// Returns four parameters; missing ones at the end are 0.
fn four(row: &[f64]) -> [f64; 4] {
    std::array::from_fn(|i| row.get(i).copied().unwrap_or(0.0))
}
