//! Names of the quantities.

/// Scalar or vector quantity of sensor rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Validity: 1 for a ray that was followed to its end. It is 0 if the ray is trapped or left
    /// its medium's field, or if no ray of the reference connects its ends. All other channels of
    /// the path are then 0.
    Valid,
    /// Position of the exit in the world, scene units.
    ExitPosition,
    /// Unit direction at the exit, in the world.
    ExitDirection,
    /// Angles in radians between the directions at the exit and at the start, along the sensor's
    /// local x and y axes: see [`deflection`](super::deflection).
    Deflection,
    /// Apparent displacement of the point where the ray ends, relative to straight rays, in pixels
    /// to the right and downwards (docs/theory.md#displacement).
    Displacement,
    /// Optical length ∫n ds up to the exit, in scene units.
    OpticalLength,
    /// Arc length ∫ds up to the exit, in scene units.
    ArcLength,
    /// Optical depth ∫σ_t ds up to the exit, in the film's first channel.
    OpticalDepth,
    /// Number of steps of the ray, including straight ones.
    Steps,
    /// Optical path difference: ∫n ds up to the exit less ∫n ds of rays of the reference, in scene
    /// units; see [`PathDifference`](eikonal::PathDifference).
    OpticalPathDifference,
    /// Optical path difference in wavelengths.
    Waves,
    /// Diffuse reflectance of the first surface: see [`Bsdf::albedo`](crate::bsdf::Bsdf::albedo).
    Albedo,
    /// Arc length ∫ds up to the first surface, in scene units.
    Depth,
    /// Position on the first surface, scene units.
    Position,
    /// Texture coordinates on the first surface.
    TextureCoordinates,
    /// Unit normal of the first surface, on the shape's own side.
    GeometricNormal,
    /// Unit shading normal of the first surface, on the same side as the geometric normal.
    ShadingNormal,
    /// Derivative of the position on the first surface by the first texture coordinate, in scene
    /// units.
    PositionByU,
    /// Derivative of the position on the first surface by the second texture coordinate, in scene
    /// units.
    PositionByV,
    /// Number of the part of the first surface: see
    /// [`Hit::primitive`](crate::shape::Hit::primitive).
    PrimitiveIndex,
    /// Number of the object of the first surface, from 1.
    ShapeIndex,
}

impl Aov {
    /// All quantities, in the order in which they are stored.
    pub const ALL: [Aov; 21] = [
        Aov::Valid,
        Aov::ExitPosition,
        Aov::ExitDirection,
        Aov::Deflection,
        Aov::Displacement,
        Aov::OpticalLength,
        Aov::ArcLength,
        Aov::OpticalDepth,
        Aov::Steps,
        Aov::OpticalPathDifference,
        Aov::Waves,
        Aov::Albedo,
        Aov::Depth,
        Aov::Position,
        Aov::TextureCoordinates,
        Aov::GeometricNormal,
        Aov::ShadingNormal,
        Aov::PositionByU,
        Aov::PositionByV,
        Aov::PrimitiveIndex,
        Aov::ShapeIndex,
    ];

    /// Returns true if the quantity describes the first surface that a ray meets. Its values are 0
    /// if there is no surface. All other quantities describe the path of the ray.
    pub fn is_of_surface(self) -> bool {
        match self {
            Aov::Valid | Aov::ExitPosition | Aov::ExitDirection | Aov::Deflection => false,
            Aov::Displacement => false,
            Aov::OpticalLength | Aov::ArcLength | Aov::OpticalDepth | Aov::Steps => false,
            Aov::OpticalPathDifference | Aov::Waves => false,
            Aov::Albedo | Aov::Depth | Aov::Position | Aov::TextureCoordinates => true,
            Aov::GeometricNormal | Aov::ShadingNormal => true,
            Aov::PositionByU | Aov::PositionByV => true,
            Aov::PrimitiveIndex | Aov::ShapeIndex => true,
        }
    }

    /// Returns the name in scene files. Names of first-surface quantities are Mitsuba's.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Valid => "valid",
            Aov::ExitPosition => "exit_position",
            Aov::ExitDirection => "exit_direction",
            Aov::Deflection => "deflection",
            Aov::Displacement => "displacement",
            Aov::OpticalLength => "optical_length",
            Aov::ArcLength => "arc_length",
            Aov::OpticalDepth => "optical_depth",
            Aov::Steps => "steps",
            Aov::OpticalPathDifference => "optical_path_difference",
            Aov::Waves => "waves",
            Aov::Albedo => "albedo",
            Aov::Depth => "depth",
            Aov::Position => "position",
            Aov::TextureCoordinates => "uv",
            Aov::GeometricNormal => "geo_normal",
            Aov::ShadingNormal => "sh_normal",
            Aov::PositionByU => "dp_du",
            Aov::PositionByV => "dp_dv",
            Aov::PrimitiveIndex => "prim_index",
            Aov::ShapeIndex => "shape_index",
        }
    }

    /// Returns the names of the quantity's channels, as in images without other channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Aov::Valid => &["valid"],
            Aov::ExitPosition => &["exit.position.X", "exit.position.Y", "exit.position.Z"],
            Aov::ExitDirection => &["exit.direction.X", "exit.direction.Y", "exit.direction.Z"],
            Aov::Deflection => &["deflection.X", "deflection.Y"],
            Aov::Displacement => &["displacement.X", "displacement.Y"],
            Aov::OpticalLength => &["optical_length"],
            Aov::ArcLength => &["arc_length"],
            Aov::OpticalDepth => &["optical_depth"],
            Aov::Steps => &["steps"],
            Aov::OpticalPathDifference => &["optical_path_difference"],
            Aov::Waves => &["waves"],
            Aov::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
            Aov::Depth => &["depth.T"],
            Aov::Position => &["position.X", "position.Y", "position.Z"],
            Aov::TextureCoordinates => &["uv.U", "uv.V"],
            Aov::GeometricNormal => &["geo_normal.X", "geo_normal.Y", "geo_normal.Z"],
            Aov::ShadingNormal => &["sh_normal.X", "sh_normal.Y", "sh_normal.Z"],
            Aov::PositionByU => &["dp_du.X", "dp_du.Y", "dp_du.Z"],
            Aov::PositionByV => &["dp_dv.X", "dp_dv.Y", "dp_dv.Z"],
            Aov::PrimitiveIndex => &["prim_index.I"],
            Aov::ShapeIndex => &["shape_index.I"],
        }
    }
}
