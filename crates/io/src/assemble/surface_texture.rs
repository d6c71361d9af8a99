//! Textures of surfaces: images, checkerboards, mesh attributes, volumes, and scaled textures.

use super::assets::Attributes;
use super::clipping::{Pixels, without_rounding};
use super::context::Context;
pub(super) use super::texture_role::{RequestedValues, Role};
use crate::diagnostic::{Location, shown, suggest};
use crate::image::RgbImage;
use crate::mesh::MeshAttribute;
use crate::query::{Input, Query, unknown_plugin};
use crate::scene::{FileRegistry, ObjectDescription, PluginKind, SpectrumValue, srgb_from_linear};
use glam::{DAffine2, DMat4};
use std::path::PathBuf;
use std::sync::Arc;
use transport::Spectrum;
use transport::emitter::Slide;
use transport::shape::Mesh;
use transport::texture::{
    Bitmap, BitmapFilter, Checkerboard, ScaledTexture, Texture, VertexColours, Wrap,
};
use transport::volume::VolumeTexture;

/// Mesh to which textures apply, with its attributes.
pub(super) type Vertices = Option<(Arc<Mesh>, Attributes)>;

/// Builds the texture of a quantity that is given as a spectrum or as a nested texture.
pub(super) fn texture(
    input: Input,
    role: Role,
    parent: &ObjectDescription,
    name: &str,
    vertices: &Vertices,
    context: &mut Context,
) -> Texture {
    texture_for(
        RequestedValues::plainly(role),
        input,
        parent,
        name,
        vertices,
        context,
    )
}

/// Builds the texture of a quantity for a role and a factor.
fn texture_for(
    requested: RequestedValues,
    input: Input,
    parent: &ObjectDescription,
    name: &str,
    vertices: &Vertices,
    context: &mut Context,
) -> Texture {
    let role = requested.role;
    match input {
        Input::Spectrum(SpectrumValue::Rgb([x, y, z])) if role == Role::Vector => {
            Texture::Uniform(Spectrum([x, y, z, 0.0]))
        }
        Input::Spectrum(value) => {
            let property = parent.properties.iter().find(|p| p.name == name);
            let location = property.map_or(&parent.location, |p| &p.location);
            Texture::Uniform(context.spectrum(&value, role, location))
        }
        Input::Object(object) => {
            nested(requested, object, vertices, context).unwrap_or(Texture::Uniform(Spectrum::ZERO))
        }
    }
}

/// Builds a texture from its plugin. A bitmap is built once, for all surfaces that it covers.
fn nested(
    requested: RequestedValues,
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Option<Texture> {
    let role = requested.role;
    match object.plugin.as_str() {
        "bitmap" => context.once(
            |assets| &mut assets.textures,
            (object.number, role),
            |context| {
                let bitmap = bitmap(requested, object, context)?;
                Some(Texture::Bitmap(Arc::new(bitmap)))
            },
        ),
        "checkerboard" => Some(checkerboard(requested, object, vertices, context)),
        "mesh_attribute" => attribute(object, role, vertices, context),
        "scale" => Some(scaled(requested, object, vertices, context)),
        "volume" => volume(object, role, context),
        _ => {
            unknown_plugin(object, context.diagnostics);
            None
        }
    }
}

/// Builds a nested texture, or a spectrum, times a factor.
fn scaled(
    requested: RequestedValues,
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Texture {
    let mut q = Query::new(object, context.diagnostics);
    let factor = q.spectrum("scale");
    let input = match q.child(PluginKind::Texture) {
        Some(texture) => Input::Object(texture),
        None => Input::Spectrum(q.spectrum("value")),
    };
    q.finish(&[]);
    let role = requested.role;
    let least = match &factor {
        SpectrumValue::Uniform(v) | SpectrumValue::EqualEnergy(v) => *v,
        SpectrumValue::Rgb(rgb) => rgb.iter().copied().fold(f64::INFINITY, f64::min),
        _ => 0.0,
    };
    let requested = RequestedValues {
        factor: requested.factor * least,
        ..requested
    };
    let nested = texture_for(requested, input, object, "value", vertices, context);
    let is_colour = matches!(factor, SpectrumValue::Rgb([r, g, b]) if r != g || g != b);
    if is_colour && (role.is_number() || context.channels.count() == 1) {
        let message = "a colour cannot scale what becomes one number: make 'scale' a number";
        context.error_at(&object.location, message);
    }
    let factor = match (role, factor) {
        // The factor may exceed the limits of the role: only the product must lie within them.
        (Role::Number | Role::Height | Role::Vector, factor) => in_role(&factor, Role::Number),
        (_, factor) => factor,
    };
    let factor = context.spectrum(&factor, Role::Coefficient, &object.location);
    Texture::Scaled(Arc::new(ScaledTexture::new(nested, factor)))
}

/// Builds a texture from a volume, evaluated at the points of a surface.
fn volume(object: &ObjectDescription, role: Role, context: &mut Context) -> Option<Texture> {
    let mut q = Query::new(object, context.diagnostics);
    let nested = q.required_child(PluginKind::Volume);
    q.finish(&[]);
    let nested = nested?;
    if nested.plugin == "constvolume" {
        return Some(constant(nested, role, context));
    }
    let allowed = match role {
        Role::Reflectance => [0.0, 1.0],
        Role::Coefficient | Role::Number | Role::Height => [0.0, f64::MAX],
        Role::Emission | Role::Vector => {
            let message = "light and normals of a surface cannot be a volume: use a 'bitmap'";
            context.error_at(&object.location, message);
            return None;
        }
    };
    let quantity =
        super::texture::texture(Input::Object(nested), object, "volume", allowed, context);
    if let VolumeTexture::Grid(grid) = &quantity
        && role.is_number()
        && grid.channels() > 1
    {
        let message = "this parameter is a number, not a colour: the grid must have one channel";
        context.error_at(&nested.location, message);
    }
    Some(Texture::Volume(Arc::new(quantity)))
}

/// Builds a texture from a constant volume.
fn constant(object: &ObjectDescription, role: Role, context: &mut Context) -> Texture {
    let mut q = Query::new(object, context.diagnostics);
    let value = q.spectrum("value");
    q.has("to_world");
    q.finish(&[]);
    texture(
        Input::Spectrum(value),
        role,
        object,
        "value",
        &None,
        context,
    )
}

/// Builds a checkerboard of two values or nested textures.
fn checkerboard(
    requested: RequestedValues,
    object: &ObjectDescription,
    vertices: &Vertices,
    context: &mut Context,
) -> Texture {
    let mut q = Query::new(object, context.diagnostics);
    let colours = ["color0", "color1"].map(|name| (name, q.texture_or_spectrum(name)));
    let to_uv = to_uv(&mut q);
    q.finish(&[]);
    let colours =
        colours.map(|(name, input)| texture_for(requested, input, object, name, vertices, context));
    Texture::Checkerboard(Arc::new(Checkerboard::new(colours, to_uv)))
}

/// Builds a texture from an attribute of a mesh; `None` after an error.
fn attribute(
    object: &ObjectDescription,
    role: Role,
    vertices: &Vertices,
    context: &mut Context,
) -> Option<Texture> {
    let mut q = Query::new(object, context.diagnostics);
    let name = q.string("name");
    let scale = q.float("scale");
    let attributes = vertices.as_ref().map(|(_, attributes)| &attributes[..]);
    let found = attributes.into_iter().flatten().find(|a| a.name == name);
    if found.is_none() && q.has("name") {
        let message = no_attribute(&name, attributes.unwrap_or_default());
        q.error("name", message);
    }
    q.finish(&[]);
    let ((mesh, _), attribute) = (vertices.as_ref()?, found?);
    let mut value = |value: &[f32; 3]| {
        let [x, y, z] = value.map(|v| f64::from(v) * scale);
        if role == Role::Vector {
            return Ok(Spectrum([x, y, z, 0.0]));
        }
        let value = if attribute.is_number {
            SpectrumValue::Uniform(x)
        } else {
            in_role(&SpectrumValue::Rgb([x, y, z]), role)
        };
        context.in_channels(&value)
    };
    let values: Result<Vec<Spectrum>, String> = attribute.values.iter().map(&mut value).collect();
    let values = context.accept(&object.location, values)?;
    let texture = if attribute.is_of_faces() {
        VertexColours::of_triangles(mesh.clone(), values)
    } else {
        VertexColours::new(mesh.clone(), values)
    };
    let texture = context.accept(&object.location, texture)?;
    Some(Texture::Vertices(Arc::new(texture)))
}

/// Returns the message about an attribute that a mesh does not have.
fn no_attribute(name: &str, attributes: &[MeshAttribute]) -> String {
    const ALWAYS: [&str; 2] = ["vertex_color", "face_color"];
    let names = attributes.iter().map(|a| a.name.as_str());
    if let Some(similar) =
        suggest(name, names.clone().chain(ALWAYS)).filter(|_| !ALWAYS.contains(&name))
    {
        return format!("the shape has no '{name}'; {similar}");
    }
    match name {
        "face_color" => {
            "the shape has no colours of faces: a .ply file with properties r, g, b (or red, green, blue, or color_0, \
             color_1, color_2) of its faces has them"
                .to_owned()
        }
        "vertex_color" => {
            "the shape has no colours: a .ply file with properties r, g, b (or red, green, blue, or color_0, color_1, \
             color_2) of its vertices has them, and an .obj file with three numbers after each position"
                .to_owned()
        }
        _ => {
            let names: Vec<_> = names.collect();
            format!(
                "the shape has no '{name}', which begins with 'vertex_' or 'face_': it has {}",
                if names.is_empty() { "none".to_owned() } else { names.join(", ") }
            )
        }
    }
}

/// Builds a texture from an image; `None` after an error.
fn bitmap(
    requested: RequestedValues,
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<Bitmap> {
    let mut q = Query::new(object, context.diagnostics);
    let source = picture(&mut q, context.files);
    let (filter, wrap) = (filter(&mut q), wrap(&mut q));
    let to_uv = to_uv(&mut q);
    q.finish(&[]);
    let picture = source?;
    let (channels, data) = clipped(&picture, requested, &object.location, context)?;
    let size = [picture.image.width, picture.image.height];
    let bitmap = Bitmap::new(size, channels, data, filter, wrap, to_uv);
    context.accept(&object.location, bitmap)
}

/// Reads the image of a projector from a bitmap.
pub(super) fn screen(object: &ObjectDescription, context: &mut Context) -> Option<Slide> {
    let mut q = Query::new(object, context.diagnostics);
    let source = picture(&mut q, context.files);
    let (filter, wrap) = (filter(&mut q), wrap(&mut q));
    q.finish(&[]);
    let picture = source?;
    let requested = RequestedValues::plainly(Role::Emission);
    let (channels, data) = clipped(&picture, requested, &object.location, context)?;
    let used = context.channels_of_group();
    let spectrum = |values: &[f32]| {
        let channel = |c: usize| f64::from(values[c.min(channels - 1)]);
        Spectrum(std::array::from_fn(
            |c| if c < used { channel(c) } else { 0.0 },
        ))
    };
    let pixels = data.chunks_exact(channels).map(spectrum).collect();
    Some(Slide {
        size: [picture.image.width, picture.image.height],
        pixels,
        filter,
        wrap,
    })
}

/// Returns width and height of a bitmap and the transmittances of its pixels, converted to one
/// number each; `None` after an error.
pub(super) fn transmittances(
    object: &ObjectDescription,
    context: &mut Context,
) -> Option<([usize; 2], Vec<f64>)> {
    let mut q = Query::new(object, context.diagnostics);
    let source = picture(&mut q, context.files);
    q.finish(&[]);
    let picture = source?;
    let requested = RequestedValues::plainly(Role::Number);
    let (_, data) = clipped(&picture, requested, &object.location, context)?;
    let size = [picture.image.width, picture.image.height];
    Some((size, data.into_iter().map(f64::from).collect()))
}

/// Returns the number of channels and the values of an image, with values outside their limits
/// clipped; `None` if they are refused. Reports both.
fn clipped(
    picture: &Picture,
    requested: RequestedValues,
    location: &Location,
    context: &mut Context,
) -> Option<(usize, Vec<f32>)> {
    let pixels = pixels(picture, requested.role, context);
    let (channels, mut data) = context.accept(location, pixels)?;
    let mut seen = Pixels::new();
    for pixel in data.chunks_exact(channels) {
        seen.see(pixel.iter().copied().map(f64::from), 1.0);
    }
    if accepted(&seen, &picture.name, requested, location, context)? {
        for v in &mut data {
            *v = without_rounding(f64::from(*v), requested.role) as f32;
        }
    }
    Some((channels, data))
}

/// Returns true if values must be clipped, `None` if they are refused. Reports both.
pub(super) fn accepted(
    seen: &Pixels,
    name: &str,
    requested: RequestedValues,
    location: &Location,
    context: &mut Context,
) -> Option<bool> {
    let (message, accepted) = match seen.verdict(name, requested) {
        Ok(None) => return Some(false),
        Ok(Some(remark)) => (remark, Some(true)),
        Err(error) => (error, None),
    };
    context.diagnostics.push(message.at(location));
    accepted
}

/// Image of a bitmap, from a file or from the scene itself.
struct Picture {
    image: RgbImage,
    /// Name in messages.
    name: String,
    /// True if the sRGB decoding of the file must be undone.
    encode: bool,
}

/// Reads the image of a bitmap, from an array or a file; `None` after an error.
fn picture(q: &mut Query, files: &mut FileRegistry) -> Option<Picture> {
    let raw = q.boolean("raw");
    let read = image(q, files)?;
    Some(Picture {
        encode: raw && read.path.is_some_and(|path| RgbImage::is_encoded(&path)),
        image: read.image,
        name: read.name,
    })
}

/// Image that an object holds or names.
pub(super) struct Read {
    pub image: RgbImage,
    /// Name in messages.
    pub name: String,
    /// File of the image, unless the object holds it.
    path: Option<PathBuf>,
}

/// Reads an image from an array or a file; `None` after an error.
pub(super) fn image(q: &mut Query, files: &mut FileRegistry) -> Option<Read> {
    if q.has("data") {
        if q.has("filename") {
            q.error("data", "give 'data' or 'filename', not both");
        }
        let image = RgbImage::of_tensor(&*q.tensor("data")?);
        return Some(Read {
            image: image.map_err(|e| q.error("data", e.to_string())).ok()?,
            name: "'data'".to_owned(),
            path: None,
        });
    }
    let path = q.path("filename", files);
    let image = RgbImage::read_within(&path, files.limits());
    Some(Read {
        image: image.map_err(|e| q.file_error("filename", &e)).ok()?,
        name: shown(&path).to_string(),
        path: Some(path),
    })
}

fn filter(q: &mut Query) -> BitmapFilter {
    // Accept Mitsuba's storage format of images, which affects at most the rounding.
    q.word("format");
    match q.word("filter_type") {
        "nearest" => BitmapFilter::Nearest,
        _ => BitmapFilter::Bilinear,
    }
}

fn wrap(q: &mut Query) -> Wrap {
    match q.word("wrap_mode") {
        "mirror" => Wrap::Mirror,
        "clamp" => Wrap::Clamp,
        _ => Wrap::Repeat,
    }
}

/// Returns the number of channels and the values of an image.
fn pixels(picture: &Picture, role: Role, context: &Context) -> Result<(usize, Vec<f32>), String> {
    let image = &picture.image;
    let as_stored = |v: f32| {
        if picture.encode {
            srgb_from_linear(f64::from(v))
        } else {
            f64::from(v)
        }
    };
    if role == Role::Vector {
        let values = image.pixels.iter().flatten();
        return Ok((3, values.map(|v| as_stored(*v) as f32).collect()));
    }
    // A grey image has one value for all wavelengths.
    let grey = image.pixels.iter().all(|[r, g, b]| r == g && g == b);
    if grey {
        let values = image.pixels.iter().map(|[v, ..]| as_stored(*v) as f32);
        return Ok((1, values.collect()));
    }
    if role.is_number() {
        let luminance = |rgb: &[f32; 3]| super::colour::luminance(rgb.map(as_stored)) as f32;
        return Ok((1, image.pixels.iter().map(luminance).collect()));
    }
    let channels = context.channels_of_group();
    let mut data = Vec::with_capacity(channels * image.pixels.len());
    for rgb in &image.pixels {
        let value = context.in_channels(&SpectrumValue::Rgb(rgb.map(as_stored)));
        let value = value.map_err(|_| {
            "a coloured bitmap has no meaning on a spectral film; use a grey one, or a spectrum"
        })?;
        data.extend(value.0[..channels].iter().map(|v| *v as f32));
    }
    Ok((channels, data))
}

/// Returns a value, or its luminance for roles that are one number.
fn in_role(value: &SpectrumValue, role: Role) -> SpectrumValue {
    match value {
        SpectrumValue::Rgb(rgb) if role.is_number() => {
            SpectrumValue::Uniform(super::colour::luminance(*rgb))
        }
        _ => value.clone(),
    }
}

/// Reads the map of texture coordinates: the part of a transform that acts on x and y.
fn to_uv(q: &mut Query) -> DAffine2 {
    let matrix: DMat4 = q.transform("to_uv");
    DAffine2::from_cols(
        matrix.x_axis.truncate().truncate(),
        matrix.y_axis.truncate().truncate(),
        matrix.w_axis.truncate().truncate(),
    )
}
