//! Shapes made of triangles, from files or from the scene itself.

use super::super::assets::{Attributes, Original};
use super::super::content::{ContentHasher, MESHES};
use super::Sources;
use crate::diagnostic::lints;
use crate::error::FileError;
use crate::input::Limits;
use crate::mesh::isosurface::Distances;
use crate::mesh::{MeshAttribute, MeshData, Tensors, gltf, serialized};
use crate::query::Query;
use crate::scene::{FileRegistry, ObjectDescription, Tensor};
use crate::volume::{AxisOrder, Options, Volume};
use glam::DAffine3;
use std::path::PathBuf;
use std::sync::Arc;
use transport::shape::{Mesh, Shape, ShapeError};

/// Maximum number of triangles in all copies together. They take about ten gigabytes of memory.
const MAX_COPIED_TRIANGLES: usize = 100_000_000;

/// Builds the mesh that a shape names, at its position; `None` if its file cannot be read
/// (reported). Keeps the originals of copies.
pub(super) fn mesh(
    object: &ObjectDescription,
    frame: DAffine3,
    copied: bool,
    q: &mut Query,
    sources: Sources,
) -> Option<Result<(Shape, Attributes), ShapeError>> {
    let source = Source::of(object, q, sources.files);
    let normals = Normals::of(object, q);
    let flip = Flip::of(object, q);
    let original = match sources.originals.get(&object.number) {
        Some(known) => known.clone(),
        None => match Original::new(source?.read(q, sources.files.limits())?, flip, normals) {
            Ok(original) => original,
            Err(error) => return Some(Err(error)),
        },
    };
    if copied {
        *sources.copied += original.mesh.triangles().len();
        if *sources.copied > MAX_COPIED_TRIANGLES {
            let message = format!(
                "instances are copies, and there are more than {MAX_COPIED_TRIANGLES} triangles"
            );
            q.error("filename", message);
            return None;
        }
        let kept = sources.originals.entry(object.number);
        kept.or_insert_with(|| original.clone());
    }
    Some(original.placed(frame))
}

/// Flipping of texture coordinates, v to 1 − v.
#[derive(Clone, Copy)]
enum Flip {
    No,
    Yes,
    /// Flips only texture coordinates of face corners in a .ply file.
    OfCorners,
}

impl Flip {
    /// Reads the flipping. Most programs that write .obj files, and .ply files with texture
    /// coordinates of corners, have v increase upwards, whereas images begin at the top.
    fn of(object: &ObjectDescription, q: &mut Query) -> Self {
        let kind = object.plugin.as_str();
        if !["obj", "ply"].contains(&kind) {
            return Flip::No;
        }
        let is_given = q.has("flip_tex_coords");
        match (q.boolean_or("flip_tex_coords", kind == "obj"), is_given) {
            (true, _) => Flip::Yes,
            (false, true) => Flip::No,
            (false, false) => Flip::OfCorners,
        }
    }

    /// Flips the texture coordinates of a mesh.
    fn apply(self, data: &mut MeshData) {
        let flips = match self {
            Flip::No => false,
            Flip::Yes => true,
            Flip::OfCorners => data.originals.is_some(),
        };
        let Some(uvs) = data.uvs.as_mut().filter(|_| flips) else {
            return;
        };
        uvs.iter_mut().for_each(|uv| uv[1] = 1.0 - uv[1]);
        for vertex in &data.without_uvs {
            uvs[*vertex as usize] = [0.0; 2];
        }
    }
}

/// Source of the normals with which a mesh is shaded.
#[derive(Clone, Copy, PartialEq)]
enum Normals {
    /// Normals of the triangles.
    Faces,
    /// Normals in the data, or else normals of the triangles.
    Given,
    /// Normals in the data, or else means of the normals of the triangles around each vertex.
    Smooth,
}

impl Normals {
    fn of(object: &ObjectDescription, q: &mut Query) -> Self {
        if object.plugin == "sdfgrid" {
            q.word("normals");
            return Normals::Smooth;
        }
        match (q.boolean("face_normals"), object.plugin.as_str()) {
            (true, _) => Normals::Faces,
            (false, "mesh" | "gltf") => Normals::Given,
            (false, _) => Normals::Smooth,
        }
    }
}

/// Grid of numbers.
enum Grid {
    File(PathBuf),
    Held(Arc<Tensor>),
}

/// Source of the triangles of a shape.
enum Source {
    File(PathBuf),
    /// File of several meshes, and the number of the requested one.
    OneOf(PathBuf, usize),
    /// Arrays in the scene: positions and faces; texture coordinates, normals and colours.
    Held([Arc<Tensor>; 2], [Option<Arc<Tensor>>; 3]),
    /// Signed distances from a surface, in a file or in the scene.
    Distances(Grid),
}

impl Source {
    fn of(object: &ObjectDescription, q: &mut Query, files: &mut FileRegistry) -> Option<Self> {
        if object.plugin == "mesh" {
            let needed = ["vertex_positions", "faces"].map(|name| q.required_tensor(name));
            let others = ["vertex_texcoords", "vertex_normals", "vertex_color"];
            let others = others.map(|name| q.tensor(name));
            let [positions, faces] = needed;
            return Some(Source::Held([positions?, faces?], others));
        }
        if object.plugin == "sdfgrid" && q.has("grid") {
            if q.has("filename") {
                q.error("filename", "give 'filename' or 'grid', not both");
            }
            return Some(Source::Distances(Grid::Held(q.required_tensor("grid")?)));
        }
        let path = q.path("filename", files);
        if object.plugin == "gltf" {
            for name in gltf::data_files(&path, files.limits()) {
                files.add(path.with_file_name(&name), &name);
            }
        }
        Some(match object.plugin.as_str() {
            "serialized" => Source::OneOf(path, q.integer("shape_index") as usize),
            "sdfgrid" => Source::Distances(Grid::File(path)),
            _ => Source::File(path),
        })
    }

    /// Reads the mesh; `None` after an error, which is reported.
    fn read(self, q: &mut Query, limits: Limits) -> Option<MeshData> {
        let in_file = |e| ("filename", FileError::to_string(&e));
        let mesh = match self {
            Source::File(path) => MeshData::read_within(&path, limits).map_err(in_file),
            Source::OneOf(path, index) => serialized::read(&path, index, limits).map_err(in_file),
            Source::Distances(grid) => grid.surface(limits),
            Source::Held([positions, faces], [texcoords, normals, color]) => {
                MeshData::of_tensors(Tensors {
                    vertex_positions: &positions,
                    faces: &faces,
                    vertex_texcoords: texcoords.as_deref(),
                    vertex_normals: normals.as_deref(),
                    vertex_color: color.as_deref(),
                })
                .map_err(|(name, problem)| (name, problem.to_string()))
            }
        };
        let mesh = mesh
            .map_err(|(name, message)| q.error(name, message))
            .ok()?;
        if mesh.skipped_faces > 0 {
            let message = format!(
                "faces of fewer than three corners are left out: there are {}",
                mesh.skipped_faces
            );
            q.warning(lints::SKIPPED_FACES, "filename", message);
        }
        Some(mesh)
    }
}

impl Grid {
    /// Returns the surface at which distances are zero, or the name of a parameter with the error
    /// message.
    fn surface(self, limits: Limits) -> Result<MeshData, (&'static str, String)> {
        let surface = |name, size, values: Vec<f64>| {
            let values = &values;
            let mesh = Distances { size, values }.surface();
            mesh.map_err(|problem| (name, problem.to_string()))
        };
        match self {
            Grid::Held(grid) => {
                let size = match grid.shape() {
                    [z, y, x] | [z, y, x, 1] => [*x, *y, *z],
                    shape => {
                        let message = format!("expected shape (z, y, x, 1), found {shape:?}");
                        return Err(("grid", message));
                    }
                };
                surface("grid", size, grid.iter().collect())
            }
            Grid::File(path) => {
                let options = Options::order(AxisOrder::ZYX).within(limits);
                let volume =
                    Volume::<f32>::read(&path, options).map_err(|e| ("filename", e.to_string()))?;
                if volume.channels() != 1 {
                    return Err(("filename", "distances have one channel".to_owned()));
                }
                let values = volume.data().iter().map(|v| f64::from(*v)).collect();
                surface("filename", volume.size(), values)
            }
        }
    }
}

impl Original {
    /// Builds a mesh before placement, with its attributes.
    fn new(mut data: MeshData, flip: Flip, normals: Normals) -> Result<Self, ShapeError> {
        flip.apply(&mut data);
        let colours = [
            ("vertex_color", data.colours.take()),
            ("face_color", data.face_colours.take()),
        ];
        let mut attributes = std::mem::take(&mut data.attributes);
        for (name, values) in colours {
            attributes.extend(values.map(|values| MeshAttribute::colours(name, values)));
        }
        if normals == Normals::Faces {
            data.normals = None;
        }
        let is_smooth = normals == Normals::Smooth;
        let content = content(&data, is_smooth);
        Ok(Original {
            content,
            mesh: Arc::new(built(data, is_smooth)?),
            attributes: Arc::new(attributes),
        })
    }

    /// Places the mesh. Scenes with an equal mesh at an equal place share it.
    fn placed(self, frame: DAffine3) -> Result<(Shape, Attributes), ShapeError> {
        let content = self.content.doubles(&frame.to_cols_array()).finish();
        let mesh = MESHES.try_get(content, || {
            Arc::unwrap_or_clone(self.mesh).transformed(frame)
        })?;
        Ok((Shape::from(mesh), self.attributes))
    }
}

/// Starts the hash of the data on which a mesh depends.
fn content(data: &MeshData, is_smooth: bool) -> ContentHasher {
    let uvs = data.uvs.as_deref().map(<[_]>::as_flattened);
    let has = [
        data.uvs.is_some(),
        data.normals.is_some(),
        data.originals.is_some(),
        is_smooth,
    ];
    ContentHasher::default()
        .doubles(&has.map(|has| f64::from(u8::from(has))))
        .vectors(&data.positions)
        .indices(data.triangles.as_flattened())
        .doubles(uvs.unwrap_or_default())
        .vectors(data.normals.as_deref().unwrap_or_default())
        .indices(data.originals.as_deref().unwrap_or_default())
}

/// Builds a mesh with the normals in the data, or else with smooth normals if `smooth` is true.
pub(super) fn built(data: MeshData, smooth: bool) -> Result<Mesh, ShapeError> {
    let mesh = Mesh::new(data.positions, data.triangles, data.uvs)?;
    match data.normals {
        Some(normals) => mesh.with_normals(normals),
        None if smooth => match data.originals {
            Some(originals) => mesh.with_smooth_normals_across(&originals),
            None => Ok(mesh.with_smooth_normals()),
        },
        None => Ok(mesh),
    }
}
