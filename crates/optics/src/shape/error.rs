//! Errors of shapes.

use eikonal::Shown;
use thiserror::Error;

/// Reason why a shape cannot be built.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// The transformation has an infinite or undefined entry.
    #[error("the transformation must have finite entries")]
    NonFiniteTransform,
    /// The transformation collapses a direction.
    #[error("the transformation must be invertible, but its determinant is {det:e}")]
    SingularTransform {
        /// Determinant of the linear part.
        det: f64,
    },
    /// A radius is zero, negative or not finite.
    #[error("the radius must be positive and finite, but it is {}", Shown(*radius))]
    Radius {
        /// The radius given.
        radius: f64,
    },
    /// The ends of a cylinder coincide, or are not finite.
    #[error("the end points of a cylinder must be finite and distinct")]
    CylinderEnds,
    /// No triangle remains after the removal of triangles without area.
    #[error(
        "a mesh needs a triangle of positive area, but has none (degenerate triangles: {dropped})"
    )]
    EmptyMesh {
        /// Number of degenerate triangles among those given.
        dropped: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {index}, but there are only {count} vertices")]
    VertexIndex {
        /// Index of the triangle.
        triangle: usize,
        /// Index of the missing vertex.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A vertex has an infinite or undefined coordinate.
    #[error("vertex {vertex} must have finite coordinates")]
    NonFiniteVertex {
        /// Index of the vertex.
        vertex: usize,
    },
    /// The number of texture coordinates differs from the number of vertices.
    #[error("expected one pair of texture coordinates for each of {expected} vertices, got {got}")]
    UvCount {
        /// Number of vertices.
        expected: usize,
        /// Number of pairs given.
        got: usize,
    },
    /// The number of vertex normals differs from the number of vertices.
    #[error("expected one normal for each of {expected} vertices, got {got}")]
    NormalCount {
        /// Number of vertices.
        expected: usize,
        /// Number of normals given.
        got: usize,
    },
    /// The number of originals of copied vertices differs from the number of vertices, or an
    /// original does not exist.
    #[error("expected a number below {expected} for each vertex: the vertex of which it is a copy")]
    Originals {
        /// Number of vertices.
        expected: usize,
    },
    /// There are more triangles than a 32-bit index can number.
    #[error("a mesh can have at most {max} triangles, got {got}", max = u32::MAX / 2)]
    TooManyTriangles {
        /// Number of triangles given.
        got: usize,
    },
    /// A grid has more corners of voxels than a 32-bit index can number.
    #[error("a grid of labels can have at most {max} corners of voxels, but has {corners}", max = u32::MAX)]
    TooManyVoxels {
        /// Number of corners.
        corners: u128,
    },
    /// The faces of voxels across an axis have no area to rounding.
    #[error(
        "the faces of voxels across axis {axis} have no area to rounding: make the voxels thicker, or move them towards the origin"
    )]
    FlatVoxels {
        /// The axis of the grid.
        axis: usize,
    },
}
