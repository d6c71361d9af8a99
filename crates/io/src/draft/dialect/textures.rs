//! Textures of Mitsuba 0.5 and 0.6.

use super::{Draft, drop, number};
use crate::scene::Value;
use glam::{DMat4, DVec3};

/// Translates the position of an image or a checkerboard, and the filtering and decoding of an
/// image.
pub(super) fn place(draft: &mut Draft) {
    let both = number(draft, "uvscale", 1.0);
    let axes = [("uscale", "uoffset"), ("vscale", "voffset")];
    let [u, v] =
        axes.map(|(scale, offset)| [number(draft, scale, both), number(draft, offset, 0.0)]);
    let map = DMat4::from_translation(DVec3::new(u[1], v[1], 0.0))
        * DMat4::from_scale(DVec3::new(u[0], v[0], 1.0));
    let there = drop(
        draft,
        &["uvscale", "uscale", "vscale", "uoffset", "voffset"],
    );
    if !there.is_empty() {
        draft.set("to_uv", Value::Transform(map));
    }
    if draft.plugin == "bitmap" {
        wrapped(draft);
        filtered(draft);
        decoded(draft);
    }
}

fn word(draft: &Draft, name: &str) -> Option<String> {
    let property = draft.properties.iter().find(|p| p.name == name)?;
    match &property.value {
        Value::String(word) => Some(word.to_ascii_lowercase()),
        _ => None,
    }
}

/// Translates the wrap modes of both axes if they are equal. Images of morgana have one mode.
fn wrapped(draft: &mut Draft) {
    let modes = ["wrap_mode_u", "wrap_mode_v"].map(|name| word(draft, name));
    if let [Some(u), Some(v)] = modes
        && u == v
    {
        drop(draft, &["wrap_mode_u", "wrap_mode_v"]);
        draft.set("wrap_mode", Value::String(u));
    }
}

/// Replaces smooth filters by bilinear interpolation: the samples of a pixel average the image.
fn filtered(draft: &mut Draft) {
    let smooth = ["ewa", "trilinear"];
    if word(draft, "filter_type").is_some_and(|filter| smooth.contains(&filter.as_str())) {
        draft.set("filter_type", Value::String("bilinear".to_owned()));
    }
}

/// Translates the exponent of the decoding: 1 means linear values; no exponent, or the sRGB curve,
/// is the default for files of 8 bits.
fn decoded(draft: &mut Draft) {
    if !draft.names.contains_key("gamma") {
        return;
    }
    let gamma = number(draft, "gamma", 0.0);
    if gamma == 1.0 {
        drop(draft, &["gamma"]);
        draft.set("raw", Value::Boolean(true));
    } else if gamma <= 0.0 {
        drop(draft, &["gamma"]);
    }
}
