//! What spectra and textures are asked for.

/// What a spectrum or texture is asked for, which settles how it becomes red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// Light: seen as it is, not negative.
    Emission,
    /// A share of light: seen under daylight, in [0, 1].
    Reflectance,
    /// A property of matter: seen under daylight, not negative.
    Coefficient,
    /// One number: the luminance of a colour.
    Number,
    /// Three numbers that are no colour.
    Vector,
}
