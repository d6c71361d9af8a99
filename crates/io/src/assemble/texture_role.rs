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
    /// A height, which is a number without limits.
    Height,
    /// Three numbers that are no colour.
    Vector,
}

/// What the values of a texture are asked for.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub role: Role,
    /// What they are multiplied by before they count, at least.
    pub factor: f64,
}

impl Asked {
    /// As they are.
    pub(super) fn plainly(role: Role) -> Self {
        Asked { role, factor: 1.0 }
    }
}

impl Role {
    /// Whether it is one number.
    pub(super) fn is_number(self) -> bool {
        matches!(self, Role::Number | Role::Height)
    }
}
