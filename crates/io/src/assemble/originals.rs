//! Meshes of groups of shapes, kept for their copies.

use crate::scene::ObjectId;
use std::collections::HashMap;
use std::sync::Arc;
use transport::shape::Mesh;

/// Linear colours of a mesh, if it has any.
#[derive(Clone, Default)]
pub(super) struct Colours {
    pub vertices: Option<Arc<Vec<[f32; 3]>>>,
    pub faces: Option<Arc<Vec<[f32; 3]>>>,
}

/// Meshes of groups, before they are placed.
#[derive(Default)]
pub(super) struct Originals {
    pub meshes: HashMap<ObjectId, (Arc<Mesh>, Colours)>,
    /// Number of triangles of all copies.
    pub copied: usize,
}
