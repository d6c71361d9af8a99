//! What textures are asked for.

/// What a texture is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// A spectrum.
    Colour,
    /// One number: the luminance of a colour.
    Number,
}
