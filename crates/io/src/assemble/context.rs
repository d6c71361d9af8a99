//! Data gathered while a scene is assembled.

use super::CondensedGrid;
use super::assets::{Assets, Made, Table};
use super::channels::Channels;
use super::clipping;
use super::colour;
use super::placed_grid;
use super::side_request::SideRequest;
use super::sound_record::SoundRecord;
use super::texture_role::Role;
use crate::diagnostic::Difference;
use crate::diagnostic::{Diagnostic, Diagnostics, Location, lints};
use crate::query::resolve;
use crate::scene::{FileRegistry, ObjectDescription, ObjectId, SpectrumValue};
use crate::spd;
use eikonal::field::Constant;
use std::borrow::Cow;
use std::cell::Cell;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::hash::Hash;
use std::ops::Range;
use std::sync::Arc;
use transport::Spectrum;
use transport::emitter::Emitter;
use transport::medium::Medium;
use transport::meter::MeterSurface;
use transport::scene::{CellMedia, MediumId, Object, Partition};

/// Parts of the scene gathered up to this point, and their places in the scene file.
pub(super) struct Context<'a> {
    pub channels: &'a Channels,
    /// Group of channels. Parts that depend on it are built again for each group.
    pub(super) group: usize,
    /// True once the channels of the group have been used: see [`Context::once`].
    pub(super) depends_on_group: Cell<bool>,
    pub diagnostics: &'a mut Diagnostics,
    pub files: &'a mut FileRegistry,
    /// Parts that are built once for all groups.
    pub assets: &'a mut Assets,
    pub media: Vec<Medium>,
    /// True for each medium whose index is not settled yet; the dielectrics around it may define
    /// it.
    pub index_open: Vec<bool>,
    /// Source of the index of each medium that gives no index itself.
    pub index_from: HashMap<MediumId, IndexSource>,
    pub objects: Vec<Object>,
    pub emitters: Vec<Emitter>,
    /// Ids of the emitters, or of the shapes that emit.
    pub emitter_ids: Vec<Option<String>>,
    /// Meters of shapes, with the numbers of their objects.
    pub meters: Vec<MeterPlace>,
    /// Volumes that are divided into several media, before their sides are settled.
    pub divided: Vec<Divided>,
    /// Divided volumes whose sides are settled.
    pub partitions: Vec<Partition>,
    /// Media on the two sides of each object, as its description requests them.
    pub side_requests: Vec<SideRequest>,
    pub places: Places,
    /// Number of triangles of all copies.
    pub copied: usize,
    /// Grids and their positions.
    pub grids: Vec<placed_grid::Placed>,
    /// Components of the volumes of sound.
    pub sounds: Vec<SoundRecord>,
    /// Grids of the index that are stored with fewer samples.
    pub condensed: Vec<CondensedGrid>,
    /// Points in which Mitsuba would render the scene differently.
    pub differences: BTreeSet<Difference>,
    /// Groups of shapes that contain an error.
    pub refused_groups: HashSet<ObjectId>,
    medium_ids: HashMap<ObjectId, MediumId>,
}

/// Source of the index of a medium.
pub(super) struct IndexSource {
    pub name: &'static str,
    pub location: Location,
}

/// Meter that measures at surfaces.
pub(super) struct MeterPlace {
    pub meter: Arc<ObjectDescription>,
    pub surfaces: Vec<MeterSurface>,
    /// True if the surfaces belong to one shape, which has its own coordinates.
    pub is_shape: bool,
}

/// Volume divided into media, before the media on its sides are settled.
pub(super) struct Divided {
    /// Indices of the volume's surfaces among the objects.
    pub objects: Range<usize>,
    /// Media behind and in front of each surface; `None` is the surrounding medium.
    pub sides: Vec<[Option<MediumId>; 2]>,
    /// Cells of the volume, if its surfaces are faces of cells.
    pub cells: Option<CellMedia>,
    /// Surrounding medium, if it was named.
    pub exterior: Option<MediumId>,
    /// Index of the surroundings, if it was given.
    pub outer_index: Option<f64>,
    pub location: Location,
}

/// Places in scene files.
pub(super) struct Places {
    /// Places of the media; `None` for media that no file mentions.
    pub media: Vec<Option<Location>>,
    pub objects: Vec<Location>,
    pub emitters: Vec<Location>,
}

impl<'a> Context<'a> {
    pub(super) fn new(
        channels: &'a Channels,
        group: usize,
        diagnostics: &'a mut Diagnostics,
        files: &'a mut FileRegistry,
        assets: &'a mut Assets,
    ) -> Self {
        let ambient = Medium::transparent("ambient", Constant::new(1.0));
        Context {
            channels,
            group,
            depends_on_group: Cell::new(false),
            diagnostics,
            files,
            assets,
            media: vec![ambient],
            index_open: vec![true],
            index_from: HashMap::new(),
            objects: Vec::new(),
            emitters: Vec::new(),
            emitter_ids: Vec::new(),
            meters: Vec::new(),
            divided: Vec::new(),
            partitions: Vec::new(),
            side_requests: Vec::new(),
            places: Places {
                media: vec![None],
                objects: Vec::new(),
                emitters: Vec::new(),
            },
            copied: 0,
            grids: Vec::new(),
            sounds: Vec::new(),
            condensed: Vec::new(),
            differences: BTreeSet::new(),
            refused_groups: HashSet::new(),
            medium_ids: HashMap::new(),
        }
    }

    /// Reports an error.
    pub(crate) fn error_at(&mut self, location: &Location, message: impl Into<String>) {
        self.diagnostics
            .push(Diagnostic::error(message).at(location));
    }

    /// Reports the error of a constructor; `None` then.
    pub(super) fn accept<T, E: std::fmt::Display>(
        &mut self,
        location: &Location,
        result: Result<T, E>,
    ) -> Option<T> {
        result
            .map_err(|e| self.error_at(location, e.to_string()))
            .ok()
    }

    /// Returns a spectrum in the channels of this group, converted for its role. Reports clipped
    /// values.
    pub(super) fn spectrum(
        &mut self,
        value: &SpectrumValue,
        role: Role,
        location: &Location,
    ) -> Spectrum {
        let value = self.loaded(value, location);
        let seen = self.channels.seen(&value, role);
        if let Ok(Some(rgb)) = seen.as_ref().map(|seen| seen.clipped) {
            let warning = lints::warning(lints::CLIPPED_VALUES, colour::clipping(rgb, role));
            self.diagnostics.push(warning.at(location));
        }
        let mut spectrum = seen
            .and_then(|seen| self.in_channels(&seen.value))
            .unwrap_or_else(|message| {
                self.error_at(location, message);
                Spectrum::ZERO
            });
        if role == Role::Reflectance
            && let Some(note) = clipping::reflectance(&mut spectrum)
        {
            self.diagnostics.push(note.at(location));
        }
        spectrum
    }

    /// Returns a spectrum in the channels of this group, without conversion.
    pub(super) fn in_channels(&self, value: &SpectrumValue) -> Result<Spectrum, String> {
        self.channels.spectrum(value, self.looked_at_group())
    }

    /// Returns the number of channels in this group.
    pub(super) fn channels_of_group(&self) -> usize {
        self.channels.channels_of(self.looked_at_group())
    }

    /// Returns the number of the first channel of this group.
    pub(super) fn first_channel(&self) -> usize {
        self.channels.first(self.looked_at_group())
    }

    /// Returns the wavelength of this group in nm, if it has just one.
    pub(super) fn wavelength(&self) -> Option<f64> {
        self.channels.wavelength(self.looked_at_group())
    }

    /// Returns the wavelengths of this group in nm, if channels are wavelengths.
    pub(super) fn wavelengths(&self) -> Option<&'a [f64]> {
        self.channels.wavelengths(self.looked_at_group())
    }

    /// Returns the group of channels, and records that the part being built depends on it.
    fn looked_at_group(&self) -> usize {
        self.depends_on_group.set(true);
        self.group
    }

    /// Returns a spectrum. If it names a file, reads the wavelengths and values from it.
    pub(super) fn loaded<'v>(
        &mut self,
        value: &'v SpectrumValue,
        location: &Location,
    ) -> Cow<'v, SpectrumValue> {
        let SpectrumValue::File(name) = value else {
            return Cow::Borrowed(value);
        };
        let path = resolve(name, location, self.files);
        let pairs = self.accept(location, spd::read(&path));
        Cow::Owned(pairs.map_or(SpectrumValue::Uniform(1.0), SpectrumValue::Sampled))
    }

    /// Adds a medium. `open` is true if its index is not settled yet.
    pub(crate) fn add_medium(
        &mut self,
        medium: Medium,
        open: bool,
        place: Option<Location>,
    ) -> MediumId {
        self.media.push(medium);
        self.index_open.push(open);
        self.places.media.push(place);
        self.media.len() - 1
    }

    /// Returns the medium that was made from an object of the description.
    pub(crate) fn known_medium(&self, id: ObjectId) -> Option<MediumId> {
        self.medium_ids.get(&id).copied()
    }

    /// Stores the medium that was made from an object of the description.
    pub(crate) fn remember_medium(&mut self, id: ObjectId, medium: MediumId) {
        self.medium_ids.insert(id, medium);
    }

    /// Returns the part with a key; `None` after an error. Builds it on first use. Builds it again
    /// for another group of channels only if building it depends on the group.
    pub(super) fn once<K: Eq + Hash, T: Clone>(
        &mut self,
        table: fn(&mut Assets) -> &mut Table<K, T>,
        key: K,
        build: impl FnOnce(&mut Self) -> Option<T>,
    ) -> Option<T> {
        let group = self.group;
        let mut key = (key, None);
        let known = table(self.assets);
        let mut found = known.get(&key).cloned();
        if found.is_none() {
            key.1 = Some(group);
            found = known.get(&key).cloned();
            if found.is_some() {
                self.depends_on_group.set(true);
            }
        }
        if let Some(made) = found {
            self.grids.extend(made.grids);
            self.sounds.extend(made.sounds);
            self.condensed.extend(made.condensed);
            return Some(made.part);
        }
        let before = self.depends_on_group.replace(false);
        let lengths = [self.grids.len(), self.sounds.len(), self.condensed.len()];
        let part = build(self);
        if !self.depends_on_group.get() {
            key.1 = None;
        }
        self.depends_on_group
            .set(before || self.depends_on_group.get());
        let part = part?;
        let made = Made {
            part: part.clone(),
            grids: self.grids[lengths[0]..].to_vec(),
            sounds: self.sounds[lengths[1]..].to_vec(),
            condensed: self.condensed[lengths[2]..].to_vec(),
        };
        table(self.assets).insert(key, made);
        Some(part)
    }
}
