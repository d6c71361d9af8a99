//! Tetrahedra with regions, from a file or from arrays.

use super::super::super::context::Context;
use super::super::super::division::{
    Cells, Division, LabelCounts, Places, Surfaces, SurfacesError,
};
use super::super::super::transforms::affine;
use crate::diagnostic::lints;
use crate::error::{FileError, Problem};
use crate::input::{self, Budget, Limits};
use crate::jdata::{AnnotatedArray, JdataValue};
use crate::mesh::tetrahedra::{Tetrahedra, TetrahedraError};
use crate::query::Query;
use crate::scene::{ObjectDescription, Tensor};
use glam::{DAffine3, DVec3};
use std::path::Path;
use std::sync::Arc;
use transport::volume::TetrahedralMesh;

/// Parameters that [`PlacedTetrahedra::read`] uses.
pub(super) const SOURCE: [&str; 5] = ["filename", "nodes", "elements", "regions", "to_world"];
/// Names of the arrays of nodes and of elements in files of JMesh, and of MMC.
const NAMES: [&[&str]; 2] = [
    &["MeshNode", "MeshVertex3", "node"],
    &["MeshElem", "MeshTet4", "elem"],
];
/// Regions of elements around wide sources and around detectors in meshes of MMC, which lie outside
/// the tissue.
const OUTSIDE: [f64; 2] = [-1.0, -2.0];
/// Largest number of a region.
const MAX_REGION: f64 = 16_777_215.0;

/// Tetrahedra with their position in the world.
pub(super) struct PlacedTetrahedra {
    mesh: Tetrahedra,
    to_world: DAffine3,
}

/// Arrays of nodes, elements and, possibly, regions.
struct Source {
    nodes: Arc<Tensor>,
    elements: Arc<Tensor>,
    regions: Option<Arc<Tensor>>,
}

/// Makes the tetrahedra of a mesh. If one of region 0 is flat, leaves out all of region 0, and also
/// returns this problem.
fn made(
    nodes: Vec<DVec3>,
    elements: Vec<[u32; 4]>,
    regions: Vec<u32>,
) -> Result<(Tetrahedra, Option<TetrahedraError>), TetrahedraError> {
    let problem = match Tetrahedra::new(nodes.clone(), elements.clone(), regions.clone()) {
        Ok(all) => return Ok((all, None)),
        Err(problem) => problem,
    };
    match problem {
        TetrahedraError::Flat { element, .. } if regions[element] == 0 => {}
        problem => return Err(problem),
    }
    let kept = elements.into_iter().zip(regions);
    let (elements, regions) = kept.filter(|(_, region)| *region != 0).unzip();
    let rest = Tetrahedra::new(nodes, elements, regions);
    rest.map(|rest| (rest, Some(problem.clone())))
        .map_err(|_| problem)
}

impl PlacedTetrahedra {
    /// Reads the tetrahedra of a shape; `None` after an error.
    pub(super) fn read(object: &ObjectDescription, context: &mut Context) -> Option<Self> {
        let source = Source::of(object, context)?;
        let mut q = Query::new(object, context.diagnostics);
        let to_world = q.transform("to_world");
        let to_world = affine(to_world, "to_world", &mut q);
        let mesh = source.mesh();
        let (mesh, left_out) = context.accept(&object.location, mesh)?;
        if let Some(problem) = left_out {
            let message = format!("the elements of region 0 are left out: {problem}");
            let help = "the exterior medium fills their space".to_owned();
            let warning = lints::warning(lints::MESH_OUTSIDE, message).help(help);
            context.diagnostics.push(warning.at(&object.location));
        }
        warn_about_holes(&mesh, object, context);
        Some(PlacedTetrahedra { mesh, to_world })
    }

    /// Counts the tetrahedra of each region.
    pub(super) fn counts(&self) -> LabelCounts {
        self.mesh.counts()
    }

    /// Divides the mesh into parts by the places of its regions.
    ///
    /// # Errors
    /// A place that has no inverse.
    pub(super) fn divide(self, places: &Places) -> Result<Division, SurfacesError> {
        let meshes = self.mesh.surfaces(|region| places[&region].part);
        let parts = places.values().map(|place| usize::from(place.part));
        let cells = Cells::Tetrahedra(Arc::new(self.placed(places)));
        Ok(Division {
            surfaces: Arc::new(Surfaces::of_meshes(meshes, self.to_world, Some(cells))?),
            members: vec![None; parts.max().unwrap_or(0)],
        })
    }
}

/// Warns that the exterior medium fills spaces that the tetrahedra enclose.
fn warn_about_holes(mesh: &Tetrahedra, object: &ObjectDescription, context: &mut Context) {
    let holes = mesh.holes();
    let Some(largest) = holes.first() else {
        return;
    };
    let spaces = match holes.len() {
        1 => "an enclosed space".to_owned(),
        count => format!("{count} enclosed spaces, the largest"),
    };
    let message = format!(
        "the tetrahedra leave {spaces} of volume {:.3e} around {:.4}, to the exterior medium",
        largest.volume, largest.place
    );
    let help = "if it is no cavity, fill it with tetrahedra";
    let warning = lints::warning(lints::MESH_HOLES, message).help(help.to_owned());
    context.diagnostics.push(warning.at(&object.location));
}

impl PlacedTetrahedra {
    /// Returns the tetrahedra in the world, with their parts. Tetrahedra of part 0 have no
    /// neighbours.
    fn placed(&self, places: &Places) -> TetrahedralMesh {
        let regions = self.mesh.regions().iter();
        let parts: Vec<u8> = regions.map(|region| places[region].part).collect();
        let mut adjacent = self.mesh.adjacent();
        for beyond in adjacent.iter_mut().flatten() {
            *beyond = beyond.filter(|number| parts[*number as usize] != 0);
        }
        let nodes = self.mesh.nodes().iter();
        let nodes: Vec<DVec3> = nodes.map(|x| self.to_world.transform_point3(*x)).collect();
        TetrahedralMesh::new(&nodes, self.mesh.elements(), &adjacent, parts)
    }
}

impl Source {
    /// Reads the arrays, or the file that holds them; `None` after an error.
    fn of(object: &ObjectDescription, context: &mut Context) -> Option<Self> {
        let mut q = Query::new(object, context.diagnostics);
        let of_scene = ["nodes", "elements", "regions"].map(|name| (name, q.has(name)));
        if !q.has("filename") {
            return Some(Source {
                nodes: q.required_tensor("nodes")?,
                elements: q.required_tensor("elements")?,
                regions: q.has("regions").then(|| q.tensor("regions")).flatten(),
            });
        }
        if let Some((name, _)) = of_scene.iter().find(|(_, is_given)| *is_given) {
            q.error(name, "give filename or arrays, not both");
            return None;
        }
        let path = q.path("filename", context.files);
        let limits = context.files.limits();
        let read = Source::read(&path, limits);
        context.accept(&object.location, read)
    }

    /// Reads the arrays of a JMesh file.
    fn read(path: &Path, limits: Limits) -> Result<Self, FileError> {
        let bytes = input::read(path)?;
        let mut budget = Budget::new(limits, bytes.len() as u64);
        let root = JdataValue::parse(&bytes).map_err(|problem| problem.at(path))?;
        let arrays = root.arrays();
        let mut named = |names: &[&str]| -> Result<Arc<Tensor>, Problem> {
            let is_wanted = |name: &str| {
                // JData may annotate names, as in "MeshElem(iso2mesh)".
                let name = name.rsplit('/').next().unwrap_or_default();
                names.contains(&name.split('(').next().unwrap_or_default())
            };
            let Some((_, value)) = arrays.iter().find(|(name, _)| is_wanted(name)) else {
                let all: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
                let message = format!(
                    "a mesh needs an array {}, but the file has: {}",
                    names.join(" or "),
                    all.join(", ")
                );
                return Err(Problem::Malformed(message));
            };
            let array = AnnotatedArray::of(value)?;
            budget.take(array.count() as u64, size_of::<f64>() as u64)?;
            array.tensor().map(Arc::new)
        };
        let found = NAMES.map(&mut named);
        let [nodes, elements] = found.map(|array| array.map_err(|problem| problem.at(path)));
        Ok(Source {
            nodes: nodes?,
            elements: elements?,
            regions: None,
        })
    }

    /// Makes the tetrahedra. Also returns the problem because of which those of region 0 are left
    /// out, if they are.
    fn mesh(&self) -> Result<(Tetrahedra, Option<TetrahedraError>), String> {
        let of = |name: &str, problem: String| format!("{name}: {problem}");
        let nodes = self.nodes.rows::<3>();
        let nodes = nodes.map_err(|e| of("nodes", e.to_string()))?;
        let nodes: Vec<DVec3> = nodes.into_iter().map(DVec3::from_array).collect();
        let elements = &self.elements;
        let [count, columns @ (4 | 5)] = *elements.shape() else {
            let message = format!(
                "expected four nodes for each tetrahedron, and possibly its region, but the array has the shape {:?}",
                elements.shape()
            );
            return Err(of("elements", message));
        };
        let at = |row: usize, column: usize| elements.get(row * columns + column);
        // Find out whether nodes are numbered from 0 or from 1.
        let corners = (0..count).flat_map(|row| (0..4).map(move |column| at(row, column)));
        let [least, most] = corners.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
            [a.min(v), b.max(v)]
        });
        let first = match (least, most) {
            _ if count == 0 => 0.0,
            (0.0, _) => 0.0,
            (1.0, most) if most == nodes.len() as f64 => 1.0,
            _ => {
                let message = format!(
                    "nodes must be numbered from 0 to {}, or from 1 to {}, but they are from {least} to {most}: leave \
                     out nodes without elements",
                    nodes.len() - nodes.len().min(1),
                    nodes.len()
                );
                return Err(of("elements", message));
            }
        };
        let whole = |name: &str, value: f64, most: f64| {
            let is_whole = value.fract() == 0.0 && (0.0..=most).contains(&value);
            let message = || {
                of(
                    name,
                    format!("expected whole numbers from 0 to {most}, but got {value}"),
                )
            };
            is_whole.then_some(value as u32).ok_or_else(message)
        };
        let node = |row: usize, column: usize| {
            whole("elements", at(row, column) - first, f64::from(u32::MAX))
        };
        let corners = |row: usize| -> Result<[u32; 4], String> {
            Ok([node(row, 0)?, node(row, 1)?, node(row, 2)?, node(row, 3)?])
        };
        let region = |row: usize| {
            let (name, value) = match &self.regions {
                Some(regions) => ("regions", regions.get(row)),
                None if columns == 5 => ("elements", at(row, 4)),
                None => return Ok(1),
            };
            // Planted error "elements around sources of MMC as tissue", found by morgana-io/io::tetrahedra::elements_around_sources_and_detectors_of_mmc_are_outside:
            // let value = if OUTSIDE.contains(&value) { 1.0 } else { value };
            let value = if OUTSIDE.contains(&value) { 0.0 } else { value };
            whole(name, value, MAX_REGION)
        };
        if let Some(regions) = &self.regions
            && regions.len() != count
        {
            let message = format!("there are {} for {count} elements", regions.len());
            return Err(of("regions", message));
        }
        let elements = (0..count).map(corners).collect::<Result<Vec<_>, _>>()?;
        let regions = (0..count).map(region).collect::<Result<Vec<_>, _>>()?;
        made(nodes, elements, regions).map_err(|problem| problem.to_string())
    }
}
