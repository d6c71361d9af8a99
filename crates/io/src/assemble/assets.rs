//! Parts that all groups of channels share. Each part is built once, for the first group that needs
//! it.

use super::CondensedGrid;
use super::content::ContentHasher;
use super::division::{Division, LabelCounts, Places};
use super::index_grid::IndexGrid;
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
use transport::emitter::Emitter;
use transport::sensor::ApertureShape;
use transport::shape::{Mesh, Shape};
use transport::texture::Texture;
use transport::volume::VolumeGrid;

/// Colours of a mesh and other quantities of its vertices and triangles.
pub(super) type Attributes = Arc<Vec<MeshAttribute>>;

/// Mesh before placement.
#[derive(Clone)]
pub(super) struct Original {
    /// Hash of the data from which the mesh was built.
    pub content: ContentHasher,
    pub mesh: Arc<Mesh>,
    pub attributes: Attributes,
}

/// Part of any type, kept alive so that other scenes can share it.
pub(super) type Held = Arc<dyn Any + Send + Sync>;

/// Parts of a description that have been built.
#[derive(Clone, Default)]
pub(super) struct Assets {
    /// Apertures of sensors, with their diffraction patterns.
    pub apertures: HashMap<ObjectId, ApertureShape>,
    /// Shapes at their positions, with their attributes.
    pub shapes: HashMap<PlacedShape, (Shape, Attributes)>,
    /// Meshes of groups of shapes, before placement.
    pub originals: HashMap<ObjectId, Original>,
    /// Parts that other scenes can share while they are held here.
    pub held: Vec<Held>,
    /// Number of voxels with each label, by label volume.
    pub label_counts: HashMap<ObjectId, Arc<LabelCounts>>,
    /// Label volumes, divided into parts.
    pub divisions: HashMap<(ObjectId, Places), Arc<Division>>,
    /// Textures from image files.
    pub textures: Table<(ObjectId, Role), Texture>,
    /// Values on grids.
    pub grids: Table<GridKey, Arc<VolumeGrid>>,
    /// Emitters with an image or measured data.
    pub emitters: Table<ObjectId, Emitter>,
    /// Refractive indices.
    pub fields: Table<ObjectId, Field>,
    /// Grids of refractive indices, at the first wavelength of the film if the index depends on it.
    pub index_grids: Table<ObjectId, IndexGrid>,
}

impl Assets {
    /// Keeps the parts of some objects, and the shapes of others. Keeps parts that depend on the
    /// channels of the film only if the channels are equal.
    pub(super) fn retain(
        &mut self,
        is_kept: impl Fn(ObjectId) -> bool,
        is_kept_shape: impl Fn(ObjectId) -> bool,
        channels_are_equal: bool,
    ) {
        // The kept parts remain without these, which may belong to other parts.
        self.held.clear();
        self.shapes.retain(|key, _| is_kept_shape(key.shape));
        self.originals.retain(|object, _| is_kept_shape(*object));
        self.label_counts.retain(|object, _| is_kept(*object));
        self.divisions.retain(|(object, _), _| is_kept(*object));
        let is_kept = |object| channels_are_equal && is_kept(object);
        self.apertures.retain(|object, _| is_kept(*object));
        self.textures.retain(|((object, _), _), _| is_kept(*object));
        self.grids.retain(|(key, _), _| is_kept(key.object));
        self.emitters.retain(|(object, _), _| is_kept(*object));
        self.fields.retain(|(object, _), _| is_kept(*object));
        self.index_grids.retain(|(object, _), _| is_kept(*object));
    }
}

/// Key of a placed shape: the shape's object, and for a copy the bits of its affine map.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) struct PlacedShape {
    shape: ObjectId,
    place: Option<[u64; 12]>,
}

impl PlacedShape {
    /// Makes the key of a shape, or of its copy at `place`.
    pub(super) fn new(shape: ObjectId, place: Option<DAffine3>) -> Self {
        PlacedShape {
            shape,
            place: place.map(|map| map.to_cols_array().map(f64::to_bits)),
        }
    }
}

/// Key of a grid: its object, with the role and the allowed range of its values.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(super) struct GridKey {
    object: ObjectId,
    is_extinction: bool,
    allowed: [u64; 2],
}

impl GridKey {
    /// Makes the key of a grid whose values must lie between the two `allowed` values.
    pub(super) fn new(object: ObjectId, is_extinction: bool, allowed: [f64; 2]) -> Self {
        GridKey {
            object,
            is_extinction,
            allowed: allowed.map(f64::to_bits),
        }
    }
}

/// Parts of one kind, by their key and, if they depend on it, by the group of channels.
pub(super) type Table<K, T> = HashMap<(K, Option<usize>), Made<T>>;

/// Part, with the notes that building it added to the context.
#[derive(Clone)]
pub(super) struct Made<T> {
    pub part: T,
    pub grids: Vec<Placed>,
    pub sounds: Vec<SoundRecord>,
    pub condensed: Vec<CondensedGrid>,
}
