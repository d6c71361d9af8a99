//! The quantities by name.

/// A quantity, or a vector of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// 1; 0 if the ray is trapped or left its medium's field, or if no ray of the reference joins its ends. All other
    /// channels of the way are 0 then.
    Valid,
    /// Position of the exit in the world, scene units.
    ExitPosition,
    /// Unit direction at the exit, in the world.
    ExitDirection,
    /// Angles in radians between the directions at the exit and at the start, along the sensor's local
    /// x and y axes: see [`deflection`](super::deflection).
    Deflection,
    /// How far the image of the point where the ray ends is from where it would be if rays were straight, in pixels to the right and
    /// downwards (docs/theory.md#displacement).
    Displacement,
    /// ∫n ds up to the exit, scene units.
    OpticalLength,
    /// ∫ds up to the exit, scene units.
    ArcLength,
    /// ∫σ_t ds up to the exit, in the film's first channel.
    OpticalDepth,
    /// Number of steps of the ray, straight ones included.
    Steps,
    /// ∫n ds up to the exit, less that of rays of the reference, scene units: see
    /// [`PathDifference`](eikonal::PathDifference).
    OpticalPathDifference,
    /// The same in wavelengths.
    Waves,
    /// Diffuse reflectance of the first surface: see [`Bsdf::albedo`](crate::bsdf::Bsdf::albedo).
    Albedo,
    /// ∫ds up to the first surface, scene units.
    Depth,
    /// Position on the first surface, scene units.
    Position,
    /// Texture coordinates there.
    TextureCoordinates,
    /// Unit normal there, on the shape's own side.
    GeometricNormal,
    /// Unit normal by which light is scattered there, on the same side.
    ShadingNormal,
    /// Derivative of the position by the first texture coordinate, scene units.
    PositionByU,
    /// Derivative of the position by the second texture coordinate, scene units.
    PositionByV,
    /// Number of the part of the first surface: see [`Hit::primitive`](crate::shape::Hit::primitive).
    PrimitiveIndex,
    /// Number of the object, from 1.
    ShapeIndex,
}

impl Aov {
    /// All, in the order in which they are stored.
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

    /// Whether it is one of the first surface on the way of a ray, rather than of the way: 0 where there is none.
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

    /// Name, as in scene files; of first surfaces that of Mitsuba.
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

    /// Names of its channels, as in images that show nothing else.
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
