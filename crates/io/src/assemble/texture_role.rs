//! Roles of spectra and textures.

/// Role of a spectrum or texture, which determines its conversion to red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// Emitted light, at least 0, converted directly.
    Emission,
    /// Fraction of light in [0, 1], converted under daylight.
    Reflectance,
    /// Property of matter, at least 0, converted under daylight.
    Coefficient,
    /// Single number, the luminance of a colour.
    Number,
    /// Height, a number without limits.
    Height,
    /// Three numbers that are not a colour.
    Vector,
}

/// Role and scale of the values of a texture.
#[derive(Clone, Copy)]
pub(super) struct RequestedValues {
    pub role: Role,
    /// Lower bound of the factor by which the values are multiplied before use.
    pub factor: f64,
}

impl RequestedValues {
    /// Makes a request for values without a factor.
    pub(super) fn plainly(role: Role) -> Self {
        RequestedValues { role, factor: 1.0 }
    }
}

impl Role {
    /// Returns true if the role is a single number.
    pub(super) fn is_number(self) -> bool {
        matches!(self, Role::Number | Role::Height)
    }
}
