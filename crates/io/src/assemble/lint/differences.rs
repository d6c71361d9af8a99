//! Deliberate differences from Mitsuba 3.9.1 that affect a scene.

use super::super::described::is_meter;
use super::super::quantities::requests_surfaces;
use crate::diagnostic::difference::*;
use crate::scene::{
    ObjectDescription, ObjectId, PluginKind, SceneDescription, SpectrumValue, Value, descendants,
};
use crate::schema;
use glam::{DMat3, DVec3};
use std::collections::{BTreeSet, HashSet};
use transport::emitter::Emitter;
use transport::scene::{AMBIENT, Scene};
use transport::shape::Shape;

/// Data known when a scene is assembled.
pub(in super::super) struct Known<'a> {
    pub description: &'a SceneDescription,
    pub scene: &'a Scene,
    /// True if the caller gives the number of samples.
    pub counted: bool,
}

/// Returns the differences that affect a scene, including those `met` during assembly.
pub(in super::super) fn of(known: &Known, met: &BTreeSet<Difference>) -> Vec<Difference> {
    let mut all = met.clone();
    let mut seen = HashSet::new();
    visit(&known.description.root, &mut seen, &mut |object| {
        all.extend(of_object(object))
    });
    all.extend(of_methods(known));
    all.extend(of_camera(known));
    let meshes = known.scene.objects().iter().map(|o| &o.shape);
    let turned = |shape: &Shape| matches!(shape, Shape::Mesh(mesh) if mesh.was_inside_out());
    if meshes.into_iter().any(turned) {
        all.insert(MESH_SIDES);
    }
    if is_spectral(&known.description.root) {
        all.remove(&SPECTRA);
    }
    all.into_iter().collect()
}

/// Returns true if a film has wavelengths rather than colours.
fn is_spectral(root: &ObjectDescription) -> bool {
    descendants([root]).any(|o| o.kind == PluginKind::Film && is(o, "pixel_format", "spectral"))
}

/// Returns true if a parameter is a list of wavelengths.
fn is_sampled(object: &ObjectDescription, name: &str) -> bool {
    matches!(
        value(object, name),
        Some(Value::Spectrum(
            SpectrumValue::Sampled(_) | SpectrumValue::File(_)
        ))
    )
}

/// Calls `f` with each object once.
fn visit(
    object: &ObjectDescription,
    seen: &mut HashSet<ObjectId>,
    f: &mut impl FnMut(&ObjectDescription),
) {
    if seen.insert(object.number) {
        f(object);
        for child in &object.children {
            visit(&child.object, seen, f);
        }
    }
}

fn value<'a>(object: &'a ObjectDescription, name: &str) -> Option<&'a Value> {
    let property = object.properties.iter().find(|p| p.name == name);
    property.map(|p| &p.value)
}

/// Returns true if a parameter is this text, ignoring case.
fn is(object: &ObjectDescription, name: &str, text: &str) -> bool {
    matches!(value(object, name), Some(Value::String(s)) if s.eq_ignore_ascii_case(text))
}

fn is_true(object: &ObjectDescription, name: &str) -> bool {
    value(object, name) == Some(&Value::Boolean(true))
}

fn number(object: &ObjectDescription, name: &str) -> Option<f64> {
    match value(object, name)? {
        Value::Float(v) => Some(*v),
        Value::Integer(v) => Some(*v as f64),
        _ => None,
    }
}

fn child<'a>(object: &'a ObjectDescription, name: &str) -> Option<&'a ObjectDescription> {
    let named = |c: &&crate::scene::Child| c.name.as_deref() == Some(name);
    object.children.iter().find(named).map(|c| &*c.object)
}

/// Returns true if an object has a child of a kind with one of these types.
fn has(object: &ObjectDescription, kind: PluginKind, plugins: &[&str]) -> bool {
    let mut children = object.children.iter().map(|c| &c.object);
    children.any(|c| c.kind == kind && plugins.contains(&c.plugin.as_str()))
}

/// Bsdfs that reflect or transmit light specularly.
const SMOOTH: [&str; 7] = [
    "dielectric",
    "thindielectric",
    "conductor",
    "plastic",
    "coating",
    "polarizer",
    "null",
];

/// Returns true if a bsdf in an object has one of these types.
fn any_bsdf(object: &ObjectDescription, plugins: &[&str]) -> bool {
    let mut nested = object.children.iter().map(|c| &c.object);
    nested.any(|c| {
        let is_bsdf = c.kind == PluginKind::Bsdf;
        is_bsdf && (plugins.contains(&c.plugin.as_str()) || any_bsdf(c, plugins))
    })
}

/// Returns the differences that follow from a single object.
fn of_object(object: &ObjectDescription) -> Vec<Difference> {
    match (object.kind, object.plugin.as_str()) {
        (PluginKind::Bsdf, "bumpmap" | "normalmap") => {
            let smooth = any_bsdf(object, &SMOOTH);
            smooth.then_some(BUMPS).into_iter().collect()
        }
        (PluginKind::Bsdf, plugin) => of_bsdf(object, plugin),
        (PluginKind::Film, _) => of_film(object),
        (PluginKind::Medium, "heterogeneous") => of_medium(object),
        (PluginKind::Medium, "homogeneous") => {
            let sampled = is_sampled(object, "sigma_t");
            sampled.then_some(SPECTRA).into_iter().collect()
        }
        (PluginKind::Spectrum | PluginKind::Texture, "blackbody" | "regular" | "irregular") => {
            vec![SPECTRA]
        }
        (PluginKind::Shape, "obj" | "ply" | "serialized" | "mesh") => {
            let may = object.plugin != "mesh" || value(object, "vertex_normals").is_some();
            let interpolated = may && !is_true(object, "face_normals");
            let bsdf = |plugins| interpolated && has(object, PluginKind::Bsdf, plugins);
            chosen([
                (MESH_NORMALS, bsdf(&["dielectric", "thindielectric"])),
                (TWO_SIDED, bsdf(&["twosided"])),
            ])
        }
        (PluginKind::Shape, "sphere") => {
            let textured = shines_by_texture(object);
            textured.then_some(TEXTURED_SPHERE).into_iter().collect()
        }
        (PluginKind::Shape, "bsplinecurve" | "linearcurve" | "hair") => vec![CURVES],
        (PluginKind::Shape, "sdfgrid") => vec![SDFGRID],
        (PluginKind::Integrator, _) => of_integrator(object),
        (PluginKind::Texture, "mesh_attribute") => {
            let coloured = ["vertex_color", "face_color"];
            let coloured = coloured.iter().any(|name| is(object, "name", name));
            coloured.then_some(VERTEX_COLOURS).into_iter().collect()
        }
        (PluginKind::Volume, "gridvolume") => {
            let wrapped = ["repeat", "mirror"];
            let wrapped = wrapped.iter().any(|mode| is(object, "wrap_mode", mode));
            wrapped.then_some(WRAP_MODE).into_iter().collect()
        }
        (PluginKind::Sensor, "radiancemeter") => vec![RADIANCEMETER],
        (PluginKind::Emitter, "directionalarea") => vec![DIRECTIONAL_AREA],
        _ => Vec::new(),
    }
}

fn of_integrator(object: &ObjectDescription) -> Vec<Difference> {
    let kinds = object.children.iter().map(|c| c.object.kind);
    let nested = kinds.filter(|kind| *kind == PluginKind::Integrator).count();
    let plugin = object.plugin.as_str();
    let several = |name| number(object, name).is_some_and(|n| n > 1.0);
    let adds = ["emitter_samples", "shading_samples"]
        .into_iter()
        .any(several);
    chosen([
        (NESTED_INTEGRATORS, nested > 1),
        (MOMENT, plugin == "moment"),
        (
            AOV,
            plugin == "depth" || (plugin == "aov" && shows_surfaces(object)),
        ),
        (DIRECT_SAMPLES, plugin == "direct" && adds),
        (HIDE_EMITTERS, is_true(object, "hide_emitters")),
    ])
}

/// Returns true if an `aov` lists quantities that Mitsuba also has.
fn shows_surfaces(object: &ObjectDescription) -> bool {
    matches!(value(object, "aovs"), Some(Value::String(list)) if requests_surfaces(list))
}

/// Returns true if the area emitter of a shape has a texture of radiance.
fn shines_by_texture(shape: &ObjectDescription) -> bool {
    let children = shape.children.iter().map(|c| &c.object);
    let mut emitters = children.filter(|o| o.kind == PluginKind::Emitter);
    emitters.any(|emitter| {
        child(emitter, "radiance").is_some_and(|radiance| radiance.kind == PluginKind::Texture)
    })
}

/// Parameters of bsdfs that are numbers.
const NUMBERS: [&str; 16] = [
    "opacity",
    "weight",
    "alpha",
    "alpha_u",
    "alpha_v",
    "roughness",
    "anisotropic",
    "metallic",
    "spec_trans",
    "spec_tint",
    "sheen",
    "sheen_tint",
    "flatness",
    "clearcoat",
    "clearcoat_gloss",
    "diff_trans",
];

fn of_bsdf(object: &ObjectDescription, plugin: &str) -> Vec<Difference> {
    let board = |name| child(object, name).is_some_and(|c| c.plugin == "checkerboard");
    let rough = [
        "roughdielectric",
        "roughconductor",
        "roughplastic",
        "pplastic",
    ]
    .contains(&plugin);
    let dielectric = ["dielectric", "roughdielectric"].contains(&plugin);
    let plastic = ["plastic", "roughplastic"].contains(&plugin);
    let met = [
        (BLEND, plugin == "blendbsdf" && mixes_mirror(object)),
        (BECKMANN, rough && !is(object, "distribution", "ggx")),
        (CHECKERBOARD, NUMBERS.into_iter().any(board)),
        (EXT_IOR, dielectric && value(object, "ext_ior").is_none()),
        (PLASTIC, plastic && !is_true(object, "lossless")),
        (
            POLARIZATION,
            ["pplastic", "polarizer", "circular", "retarder"].contains(&plugin),
        ),
        (PRINCIPLED_THIN, plugin == "principledthin"),
    ];
    chosen(met)
}

/// Returns true if one of the nested bsdfs reflects specularly.
fn mixes_mirror(object: &ObjectDescription) -> bool {
    let mirror = |o: &ObjectDescription| ["conductor", "plastic"].contains(&o.plugin.as_str());
    let nested = object.children.iter().map(|c| &c.object);
    let mut nested = nested.filter(|o| o.kind == PluginKind::Bsdf);
    nested.any(|o| mirror(o) || mixes_mirror(o))
}

fn of_film(object: &ObjectDescription) -> Vec<Difference> {
    let other = |name, word| value(object, name).is_some() && !is(object, name, word);
    let sharp = has(object, PluginKind::Rfilter, &["box"]);
    let met = [
        (BORDER, !sharp && !is_true(object, "sample_border")),
        (
            FORMAT,
            other("file_format", "openexr") || other("component_format", "float32"),
        ),
    ];
    chosen(met)
}

fn of_medium(object: &ObjectDescription) -> Vec<Difference> {
    let grid = child(object, "sigma_t");
    let turned = grid.is_some_and(|grid| match value(grid, "to_world") {
        Some(Value::Transform(m)) => {
            let linear = DMat3::from_mat4(*m);
            let off = linear - DMat3::from_diagonal(linear.diagonal());
            let size = linear
                .to_cols_array()
                .into_iter()
                .fold(0.0, |a: f64, b| a.max(b.abs()));
            off.to_cols_array()
                .into_iter()
                .any(|v| v.abs() > 1e-6 * size)
        }
        _ => false,
    });
    chosen([
        (CONSTANT_EXTINCTION, grid.is_none()),
        (ROTATED_GRID, turned),
    ])
}

/// Returns the differences whose condition is true.
fn chosen<const N: usize>(met: [(Difference, bool); N]) -> Vec<Difference> {
    met.into_iter().filter(|m| m.1).map(|m| m.0).collect()
}

/// Returns the differences that follow from the integrator and the scene.
fn of_methods(known: &Known) -> Vec<Difference> {
    let root = &known.description.root;
    let mut integrators = root.children.iter().map(|c| &c.object);
    let integrator = integrators.find(|o| o.kind == PluginKind::Integrator);
    let name = integrator.map_or("path", |i| i.plugin.as_str());
    let limited = integrator.and_then(|i| number(i, "max_depth")) >= Some(0.0);
    let media = known.scene.media().iter().any(|m| !m.is_transparent());
    let bsdfs = || known.scene.objects().iter().map(|o| &o.bsdf);
    let blind = ["path", "ptracer"].contains(&name);
    let passed =
        bsdfs().any(|b| b.is_partial()) || (name == "path" && bsdfs().any(|b| b.is_null()));
    let environment = |e: &Emitter| matches!(e, Emitter::Environment(_));
    let lit = known.scene.emitters().iter().any(environment);
    let drops = name == "path" && bsdfs().any(|b| b.is_partial()) && !lit;
    chosen([
        (PATH_MEDIA, blind && media),
        (DEPTH, limited && passed),
        (MASK, drops),
    ])
}

/// Returns the differences that follow from the camera.
fn of_camera(known: &Known) -> Vec<Difference> {
    let root = &known.description.root;
    let mut sensors = root.children.iter().map(|c| &c.object);
    let camera =
        |o: &&std::sync::Arc<ObjectDescription>| o.kind == PluginKind::Sensor && !is_meter(o);
    let Some(sensor) = sensors.find(camera) else {
        return Vec::new();
    };
    let of_kind = |kind| {
        sensor
            .children
            .iter()
            .map(|c| &c.object)
            .find(|o| o.kind == kind)
    };
    let counted =
        |sampler: &std::sync::Arc<ObjectDescription>| value(sampler, "sample_count").is_some();
    let counted = known.counted || of_kind(PluginKind::Sampler).is_some_and(counted);
    let inside = known.scene.sensor_medium();
    let clear = known.scene.medium(inside).is_transparent();
    chosen([
        (SAMPLE_COUNT, !counted),
        (BORDER, of_kind(PluginKind::Film).is_none()),
        (
            SENSOR_MEDIUM,
            inside != AMBIENT && !clear && of_kind(PluginKind::Medium).is_none(),
        ),
        (
            CLIPPING,
            sensor.plugin != "distant" && is_clipped(sensor, known.scene),
        ),
    ])
}

/// Returns a number that an object gives, or the default of the parameter; zero without either.
fn number_or_default(object: &ObjectDescription, name: &str) -> f64 {
    let plugin = schema::find(object.kind, &object.plugin);
    let default = || plugin?.parameter(name)?.default.number();
    number(object, name).or_else(default).unwrap_or_default()
}

/// Returns true if Mitsuba's clipping planes would cut a part of the scene. A box that contains the
/// camera is not tested against the near plane.
fn is_clipped(sensor: &ObjectDescription, scene: &Scene) -> bool {
    let eye = match value(sensor, "to_world") {
        Some(Value::Transform(m)) => m.w_axis.truncate(),
        _ => DVec3::ZERO,
    };
    let near = number_or_default(sensor, "near_clip");
    let far = number_or_default(sensor, "far_clip");
    scene.objects().iter().any(|object| {
        let aabb = object.shape.aabb();
        let nearest = eye.distance(eye.clamp(aabb.min, aabb.max));
        let farthest = (aabb.max - eye).abs().max((aabb.min - eye).abs()).length();
        farthest > far || (nearest > 0.0 && nearest < near)
    })
}
