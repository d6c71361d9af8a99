//! Textures of surfaces.

use super::parameter::{boolean, float, spectrum, tensor, text, transform, word};
use super::row::{one, own_plugin, plugin, texture};
use super::{Parameter, Plugin};
use crate::scene::PluginKind::{Texture, Volume};

const TO_UV: Parameter = transform("to_uv", "transform of (u, v)");

const BITMAP: &[Parameter] = &[
    text(
        "filename",
        "image file: .exr, .hdr, .pfm, .png, .jpg, .bmp or .tga; give filename or data",
    ),
    tensor(
        "data",
        "linear pixels: (rows, columns), or three axes with one or three channels",
    ),
    boolean(
        "raw",
        false,
        "true to use the file's numbers without decoding them from sRGB",
    ),
    word(
        "format",
        &["auto", "variant", "float16", "fp16", "uint8"],
        "accepted and ignored",
    ),
    word(
        "filter_type",
        &["bilinear", "nearest"],
        "interpolation between pixels",
    ),
    word(
        "wrap_mode",
        &["repeat", "mirror", "clamp"],
        "continuation outside the unit square",
    ),
    TO_UV,
];

pub(super) const PLUGINS: &[Plugin] = &[
    plugin("bitmap", "An image.", &[BITMAP], &[]),
    plugin(
        "checkerboard",
        "A board of two by two fields in each unit square.",
        &[&[
            spectrum("color0", "value of the first kind of fields").or(0.4),
            spectrum("color1", "value of the second kind of fields").or(0.2),
            TO_UV,
        ]],
        &[texture("color0"), texture("color1")],
    ),
    plugin(
        "mesh_attribute",
        "Colours, or another quantity, of the vertices or faces of a mesh.",
        &[&[
            text("name", "vertex_color, face_color, ...").required(),
            float("scale", "a factor").or(1.0),
        ]],
        &[],
    ),
    own_plugin(
        "scale",
        "A texture times a factor.",
        &[&[
            spectrum("scale", "factor, ≥ 0").or(1.0),
            spectrum("value", "colour or number instead of the texture"),
        ]],
        &[one(Texture, "The texture.")],
    ),
    plugin(
        "volume",
        "A volume, evaluated at the points of the surface.",
        &[],
        &[one(Volume, "A gridvolume or constvolume.")],
    ),
];
