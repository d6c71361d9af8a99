//! Shapes, with their surfaces and the media on both sides.

mod curves;
mod instance;
mod labels;
mod mesh;

use super::assets::{Attributes, Original, PlacedShape};
use super::context::{Context, MeterPlace};
use super::side_request::SideRequest;
use super::surface_texture::Vertices;
use super::transforms::affine;
use super::{bsdf, emitter, medium};
use crate::diagnostic::lints;
use crate::query::{Query, unknown_plugin};
use crate::scene::{FileRegistry, ObjectDescription, ObjectId, PluginKind, descendants};
use crate::schema;
use glam::DAffine3;
pub(super) use instance::fit;
use mesh::mesh;
use std::collections::HashMap;
use transport::bsdf::Bsdf;
use transport::meter::MeterSurface;
use transport::shape::{Cube, Cylinder, Disk, Rectangle, Shape, ShapeError, Sphere};

/// Adds a shape of the scene.
pub(super) fn add(object: &ObjectDescription, context: &mut Context) {
    match object.plugin.as_str() {
        // Shapes of a group are added with each instance of the group.
        "shapegroup" => {}
        "instance" => instance::add(object, context),
        "labels" | "tetrahedra" => labels::add(object, context),
        "merge" => merge(object, add, context),
        _ => add_at(object, None, context),
    }
}

/// Adds the shapes in a `merge`, which has no other effect than to hold shapes together.
fn merge(
    object: &ObjectDescription,
    add: impl Fn(&ObjectDescription, &mut Context),
    context: &mut Context,
) {
    let mut q = Query::new(object, context.diagnostics);
    let shapes = q.children(PluginKind::Shape);
    q.finish(&[]);
    for shape in shapes {
        add(shape, context);
    }
}

/// Adds a shape, or a copy of it at another place.
fn add_at(object: &ObjectDescription, place: Option<DAffine3>, context: &mut Context) {
    // Read the parameters of the shape.
    let mut q = Query::new(object, context.diagnostics);
    let interior = q.role(PluginKind::Medium, "interior").cloned();
    let exterior = q.role(PluginKind::Medium, "exterior").cloned();
    let bsdf = bsdf::of_shape(&mut q);
    let light = q.child(PluginKind::Emitter).cloned();
    let meters: Vec<_> = q
        .children(PluginKind::Sensor)
        .into_iter()
        .cloned()
        .collect();
    let flip = q.boolean("flip_normals");
    let matrix = q.transform("to_world");
    let frame = affine(matrix, "to_world", &mut q);
    // Build the geometry, or find the geometry that another group built.
    let turned =
        |(shape, attributes): (Shape, Attributes)| (shape.with_flipped_normals(flip), attributes);
    let key = PlacedShape::new(object.number, place);
    let geometry = if let Some(known) = context.assets.shapes.get(&key) {
        Some(Ok(known.clone()))
    } else {
        let sources = Sources {
            files: context.files,
            originals: &mut context.assets.originals,
            copied: &mut context.copied,
        };
        let geometry = geometry(object, frame, place, &mut q, sources);
        let geometry = geometry.map(|g| g.map(turned));
        q.finish(&[]);
        if let Some(Ok(built)) = &geometry {
            // Planted error "shapes built anew for each group of channels", found by morgana-io/io::shared_parts::groups_of_channels_share_meshes_and_grids:
            // (no line)
            context.assets.shapes.insert(key, built.clone());
        }
        geometry
    };
    if let Some(Err(ShapeError::EmptyMesh { .. })) = geometry
        && meters.is_empty()
    {
        return leave_out(object, context);
    }
    if geometry.is_none() && schema::find(PluginKind::Shape, &object.plugin).is_none() {
        unknown_plugin(object, context.diagnostics);
    }
    // Build the surface.
    let vertices = match &geometry {
        Some(Ok((Shape::Mesh(mesh), colours))) => Some((mesh.clone(), colours.clone())),
        _ => None,
    };
    let surface = match &bsdf {
        Some(bsdf) => {
            warn_without_uvs(object, bsdf, &vertices, context);
            bsdf::build(bsdf, &vertices, context)
        }
        None => bsdf::Surface {
            bsdf: bsdf::default(light.is_some()),
            indices: None,
        },
    };
    let request = SideRequest {
        interior: interior.map(|m| medium::medium(&m, context)),
        exterior: exterior.map(|m| medium::medium(&m, context)),
        indices: surface.indices,
    };
    // Add meters, emitter and object.
    let index = context.objects.len();
    let metered = MeterSurface {
        object: index,
        inverted: false,
    };
    context
        .meters
        .extend(meters.into_iter().map(|meter| MeterPlace {
            meter,
            surfaces: vec![metered],
            is_shape: true,
        }));
    let shape = match geometry {
        Some(Ok((shape, _))) => shape,
        Some(Err(error)) => {
            context.error_at(&object.location, error.to_string());
            placeholder()
        }
        None => placeholder(),
    };
    let host = emitter::Host {
        description: object,
        index,
        geometry: &shape,
        frame: place.unwrap_or(DAffine3::IDENTITY) * frame,
        vertices: &vertices,
    };
    let emitter = light.and_then(|light| emitter::add_on_shape(&light, &host, context));
    push(object, shape, surface.bsdf, emitter, request, context);
}

/// Warns about a mesh that no ray can hit.
fn leave_out(object: &ObjectDescription, context: &mut Context) {
    let name = object.id.as_ref().unwrap_or(&object.plugin);
    let message = format!("the mesh '{name}' has no triangle of positive area and is left out");
    let help = "check the file, and the scale of to_world";
    let warning = lints::warning(lints::EMPTY_MESH, message).help(help.to_owned());
    context.diagnostics.push(warning.at(&object.location));
}

/// Warns about an image or a checkerboard on a mesh without texture coordinates.
fn warn_without_uvs(
    object: &ObjectDescription,
    bsdf: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) {
    if vertices.as_ref().is_none_or(|(mesh, _)| mesh.has_uvs()) {
        return;
    }
    let is_over_uvs = |o: &&ObjectDescription| {
        o.kind == PluginKind::Texture && ["bitmap", "checkerboard"].contains(&o.plugin.as_str())
    };
    let Some(texture) = descendants([bsdf]).find(is_over_uvs) else {
        return;
    };
    let name = object.id.as_ref().unwrap_or(&object.plugin);
    let message = format!(
        "the mesh of '{name}' has no texture coordinates: {} repeats on each of its triangles",
        texture.label()
    );
    let help =
        "give the mesh texture coordinates, or use a 'mesh_attribute' of its vertices".to_owned();
    context.diagnostics.push(
        lints::warning(lints::NO_TEXTURE_COORDINATES, message)
            .help(help)
            .at(&object.location),
    );
}

/// Adds an object to the scene. Its sides are determined later.
fn push(
    object: &ObjectDescription,
    shape: Shape,
    bsdf: Bsdf,
    emitter: Option<usize>,
    request: SideRequest,
    context: &mut Context,
) {
    context.objects.push(transport::scene::Object {
        name: object.id.clone().unwrap_or_else(|| object.plugin.clone()),
        shape,
        bsdf,
        sides: None,
        emitter,
    });
    context.side_requests.push(request);
    context.places.objects.push(object.location.clone());
}

/// Returns a stand-in for a shape that could not be built. It keeps the numbers of objects right
/// until the errors are reported.
fn placeholder() -> Shape {
    let unit = Sphere::new(DAffine3::IDENTITY);
    unit.map_or_else(|_| unreachable!("the unit sphere is valid"), Shape::from)
}

/// Sources and counters that building triangle meshes uses.
struct Sources<'a> {
    files: &'a mut FileRegistry,
    /// Meshes of groups, before placement.
    originals: &'a mut HashMap<ObjectId, Original>,
    /// Number of triangles of all copies.
    copied: &'a mut usize,
}

/// Builds the geometry under a shape's own transform and, for copies, the transform of the copy.
/// `None` if the type is unknown or its file cannot be read (reported).
fn geometry(
    object: &ObjectDescription,
    own: DAffine3,
    place: Option<DAffine3>,
    q: &mut Query,
    sources: Sources,
) -> Option<Result<(Shape, Attributes), ShapeError>> {
    let frame = place.unwrap_or(DAffine3::IDENTITY) * own;
    let analytic = match object.plugin.as_str() {
        "sphere" => {
            let center = q.point("center");
            let radius = q.float("radius");
            let local = Sphere::frame(center, radius);
            local.and_then(|l| Sphere::new(frame * l)).map(Shape::from)
        }
        "cube" => Cube::new(frame).map(Shape::from),
        "rectangle" => Rectangle::new(frame).map(Shape::from),
        "disk" => Disk::new(frame).map(Shape::from),
        "cylinder" => {
            let (p0, p1) = (q.point("p0"), q.point("p1"));
            let radius = q.float("radius");
            let capped = q.boolean("capped");
            let local = Cylinder::frame(p0, p1, radius);
            local
                .and_then(|l| Cylinder::new(frame * l, capped))
                .map(Shape::from)
        }
        "obj" | "ply" | "mesh" | "serialized" | "gltf" | "sdfgrid" => {
            return mesh(object, frame, place.is_some(), q, sources);
        }
        "bsplinecurve" | "linearcurve" | "hair" => {
            let curves = curves::geometry(object, own, q, sources.files)?;
            curves.and_then(|mesh| match place {
                Some(place) => mesh.transformed(place).map(Shape::from),
                None => Ok(Shape::from(mesh)),
            })
        }
        _ => return None,
    };
    Some(analytic.map(|shape| (shape, Attributes::default())))
}
