//! Parts that all groups of channels share: each is built once, for the group that asks first.

use super::CondensedGrid;
use super::content::ContentHasher;
use super::division::{Division, LabelCounts, Places};
use super::placed_grid::Placed;
use super::sound_record::SoundRecord;
use super::texture_role::Role;
use crate::mesh::MeshAttribute;
use crate::scene::ObjectId;
use eikonal::Field;
use glam::DAffine3;
use std::any::Any;
use std::collections::HashMap;
use std::sync::Arc;
use transport::sensor::ApertureShape;
use transport::shape::{Mesh, Shape};
use transport::texture::Texture;
use transport::volume::VolumeGrid;

/// Colours of a mesh, and other quantities of its vertices and triangles.
pub(super) type Attributes = Arc<Vec<MeshAttribute>>;

/// A mesh before it is placed.
#[derive(Clone)]
pub(super) struct Original {
    /// Hash of the data from which the mesh was built.
    pub content: ContentHasher,
    pub mesh: Arc<Mesh>,
    pub attributes: Attributes,
}

/// A part of any type, held so that other scenes find it.
pub(super) type Held = Arc<dyn Any + Send + Sync>;

/// Parts of a description that were built.
#[derive(Default)]
pub(super) struct Assets {
    /// Apertures of sensors, with their patterns.
    pub apertures: HashMap<ObjectId, ApertureShape>,
    /// Shapes in their places.
    pub shapes: HashMap<PlacedShape, (Shape, Attributes)>,
    /// Meshes of groups of shapes, before they are placed.
    pub originals: HashMap<ObjectId, Original>,
    /// Parts that other scenes share as long as these are held.
    pub held: Vec<Held>,
    /// Number of voxels of each label, by volume.
    pub label_counts: HashMap<ObjectId, Arc<LabelCounts>>,
    /// Volumes of labels, divided.
    pub divisions: HashMap<(ObjectId, Places), Arc<Division>>,
    /// Textures from image files.
    pub textures: Table<(ObjectId, Role), Texture>,
    /// Quantities on grids.
    pub grids: Table<GridKey, Arc<VolumeGrid>>,
    /// Refractive indices.
    pub fields: Table<ObjectId, Field>,
}

/// A shape of the description, and the place of its copy as bits of an affine map.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct PlacedShape {
    shape: ObjectId,
    place: Option<[u64; 12]>,
}

impl PlacedShape {
    /// The shape itself, or its copy at a place.
    pub(super) fn new(shape: ObjectId, place: Option<DAffine3>) -> Self {
        PlacedShape {
            shape,
            place: place.map(|map| map.to_cols_array().map(f64::to_bits)),
        }
    }
}

/// A grid of the description with the use that it is put to.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct GridKey {
    object: ObjectId,
    is_extinction: bool,
    allowed: [u64; 2],
}

impl GridKey {
    /// A grid whose values must lie between the two `allowed` ones.
    pub(super) fn new(object: ObjectId, is_extinction: bool, allowed: [f64; 2]) -> Self {
        GridKey {
            object,
            is_extinction,
            allowed: allowed.map(f64::to_bits),
        }
    }
}

/// Parts of one kind, by what they are built from and, if they depend on it, the group of channels.
pub(super) type Table<K, T> = HashMap<(K, Option<usize>), Made<T>>;

/// A part, with what building it has noted in the context.
#[derive(Clone)]
pub(super) struct Made<T> {
    pub part: T,
    pub grids: Vec<Placed>,
    pub sounds: Vec<SoundRecord>,
    pub condensed: Vec<CondensedGrid>,
}
