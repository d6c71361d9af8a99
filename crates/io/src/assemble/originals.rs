//! Meshes of groups of shapes, kept for their copies.

use crate::mesh::MeshAttribute;
use crate::scene::ObjectId;
use std::collections::HashMap;
use std::sync::Arc;
use transport::shape::Mesh;

/// Colours of a mesh, and other quantities of its vertices and triangles.
pub(super) type Attributes = Arc<Vec<MeshAttribute>>;

/// Meshes of groups, before they are placed.
#[derive(Default)]
pub(super) struct Originals {
    pub meshes: HashMap<ObjectId, (Arc<Mesh>, Attributes)>,
    /// Number of triangles of all copies.
    pub copied: usize,
}
