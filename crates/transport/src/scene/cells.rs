//! Cells with flat faces and uniform matter, for walks from cell to cell
//! (docs/theory.md#walks-through-cells).

use super::matter::{Matter, Matters};
use super::parts::{MediumId, Object, Partition, Parts};
use crate::bsdf::Bsdf;
use crate::medium::Medium;
use glam::{DAffine3, DMat3, DVec3};
use std::ops::Range;
use std::sync::Arc;

/// Matter number that marks cells with unsuitable or unknown matter.
pub(super) const OTHER: u8 = u8::MAX;

/// Cells through which walks go from face to face. Positions and directions are in the coordinates
/// of a [`CellFrame`].
pub(crate) trait WalkCells {
    /// A cell.
    type Cell: Copy;
    /// A face of a cell.
    type Face: Copy;

    /// Returns the contents of all cells.
    fn contents(&self) -> &CellContents;

    /// Returns the coordinates of the cells.
    fn frame(&self) -> &CellFrame;

    /// Returns the cell that contains a position.
    fn cell_at(&self, place: DVec3) -> Option<Self::Cell>;

    /// Returns the number of a cell.
    fn number(cell: Self::Cell) -> usize;

    /// Returns the face through which a straight line leaves a cell, and the length up to it.
    /// `line` is a position in the cell, or within rounding of it, and the step per unit length.
    /// Returns `None` if the line stays in the cell over a length, which may be infinite.
    fn exit(&self, cell: Self::Cell, line: [DVec3; 2], length: f64) -> Option<(Self::Face, f64)>;

    /// Returns a position on a face, without its rounding error if this is possible.
    fn on_face(&self, cell: Self::Cell, face: Self::Face, place: DVec3) -> DVec3;

    /// Returns the unit normal of a face, on either side, in components along the axes of the frame.
    fn normal(&self, cell: Self::Cell, face: Self::Face) -> DVec3;

    /// Returns the space beyond a face.
    fn beyond(&self, cell: Self::Cell, face: Self::Face) -> BeyondFace<'_, Self::Cell>;

    /// Moves a position by about a length off all faces, into the cell.
    fn inside(&self, cell: Self::Cell, place: DVec3, length: f64) -> DVec3;

    /// Moves a position on a face by about a length out of the cell.
    fn outside(&self, cell: Self::Cell, face: Self::Face, place: DVec3, length: f64) -> DVec3;

    /// Returns the matter of a cell, if it is known.
    #[inline]
    fn matter(&self, cell: Self::Cell) -> Option<&CellMatter> {
        self.contents().matter(Self::number(cell))
    }
}

/// Coordinates in which cells are simple.
#[derive(Clone, Debug)]
pub(crate) struct CellFrame {
    pub to_cells: DAffine3,
    pub from_cells: DAffine3,
    /// Unit vectors along the axes.
    pub axes: DMat3,
    /// Units of the coordinates per length.
    pub per_length: DVec3,
}

impl CellFrame {
    /// Coordinates of the world.
    pub(super) const WORLD: CellFrame = CellFrame {
        to_cells: DAffine3::IDENTITY,
        from_cells: DAffine3::IDENTITY,
        axes: DMat3::IDENTITY,
        per_length: DVec3::ONE,
    };

    /// Converts a position in the world.
    pub(crate) fn in_cells(&self, x: DVec3) -> DVec3 {
        self.to_cells.transform_point3(x)
    }

    /// Converts a position to the world: the inverse of [`CellFrame::in_cells`].
    pub(crate) fn in_world(&self, place: DVec3) -> DVec3 {
        self.from_cells.transform_point3(place)
    }

    /// Converts a unit vector of the world to components along the axes.
    pub(crate) fn along_axes(&self, direction: DVec3) -> DVec3 {
        self.axes.transpose() * direction
    }

    /// Converts components along the axes to a unit vector of the world: the inverse of
    /// [`CellFrame::along_axes`].
    pub(crate) fn direction(&self, along_axes: DVec3) -> DVec3 {
        (self.axes * along_axes).normalize()
    }
}

/// Matter and medium of a cell.
#[derive(Clone, Debug)]
pub(crate) struct CellMatter {
    pub matter: Matter,
    pub medium: MediumId,
}

/// Space beyond a face.
#[derive(Clone, Copy, Debug)]
pub(crate) enum BeyondFace<'a, C> {
    /// A cell.
    Cell(C, &'a CellMatter),
    /// The medium around the volume, and its index.
    Exterior(MediumId, f64),
    /// Space with other properties, or near other surfaces.
    Unknown,
}

/// Matter of the cells of a volume, and properties of its faces.
#[derive(Clone, Debug)]
pub(crate) struct CellContents {
    /// Matter number of each cell, or [`OTHER`].
    pub(super) numbers: Arc<Vec<u8>>,
    pub(super) matters: Vec<CellMatter>,
    /// Objects that are faces of the volume.
    pub(super) objects: Range<usize>,
    /// Medium around the volume, and its index, if the index is uniform and known.
    exterior: MediumId,
    pub(super) exterior_n: Option<f64>,
    refracts: bool,
}

impl CellContents {
    /// Returns the contents of a divided volume with the given media, before its cells are numbered,
    /// and the number of each matter of the scene among its own. Returns `None` unless its faces
    /// refract all light or transmit all light straight on.
    pub(super) fn of(
        parts: &Parts,
        matters: &Matters,
        partition: &Partition,
        media: &[MediumId],
    ) -> Option<(Self, [u8; 256])> {
        let refracts = {
            let faces = &parts.objects[partition.objects.clone()];
            faces_refract(&parts.media, faces, parts.film.channels_of(0))?
        };
        let held = held(parts, matters, partition, media);
        let number_of = |matter: usize| {
            let place = held.iter().position(|(number, _)| *number == matter);
            place.and_then(|i| u8::try_from(i).ok()).unwrap_or(OTHER)
        };
        let numbers: [u8; 256] = std::array::from_fn(number_of);
        let exterior = &parts.media[partition.exterior];
        let is_constant = exterior.index.is_constant();
        let contents = CellContents {
            numbers: Arc::default(),
            matters: held.into_iter().map(|(_, matter)| matter).collect(),
            objects: partition.objects.clone(),
            exterior: partition.exterior,
            exterior_n: is_constant.then(|| exterior.index.n(DVec3::ZERO)),
            refracts,
        };
        Some((contents, numbers))
    }

    /// Returns the matter of a cell, if it is known.
    #[inline]
    pub(crate) fn matter(&self, cell: usize) -> Option<&CellMatter> {
        self.matters.get(usize::from(self.numbers[cell]))
    }

    /// Returns the space around the volume.
    #[inline]
    pub(super) fn exterior<C>(&self) -> BeyondFace<'_, C> {
        match self.exterior_n {
            Some(n) => BeyondFace::Exterior(self.exterior, n),
            None => BeyondFace::Unknown,
        }
    }

    /// Returns true if faces between different indices refract light, false if light passes straight
    /// on.
    #[inline]
    pub(crate) fn refracts(&self) -> bool {
        self.refracts
    }
}

/// Returns true if all faces between different indices refract light, and false if all faces
/// transmit it straight on, in the first `channels` channels. Returns `None` for other faces.
pub(crate) fn faces_refract(media: &[Medium], faces: &[Object], channels: usize) -> Option<bool> {
    let is_bare = faces.iter().all(|face| face.emitter.is_none());
    let clear = |face: &Object| matches!(&face.bsdf, Bsdf::Dielectric(d) if d.is_clear(channels));
    let passes = |face: &Object| matches!(face.bsdf, Bsdf::Null);
    let matched = |face: &Object| passes(face) && has_equal_indices(media, face);
    if is_bare && faces.iter().all(|face| clear(face) || matched(face)) {
        return Some(true);
    }
    (is_bare && faces.iter().all(passes)).then_some(false)
}

/// Returns true if the media on both sides of a face have one constant index.
fn has_equal_indices(media: &[Medium], face: &Object) -> bool {
    let index = |medium: MediumId| {
        let index = &media[medium].index;
        index.is_constant().then(|| index.n2(DVec3::ZERO))
    };
    face.sides.is_some_and(|sides| {
        index(sides.interior).is_some_and(|n2| index(sides.exterior) == Some(n2))
    })
}

/// Returns the matter with uniform scattering of the media of a divided volume, each with its
/// number among all matter.
fn held(
    parts: &Parts,
    matters: &Matters,
    partition: &Partition,
    media: &[MediumId],
) -> Vec<(usize, CellMatter)> {
    let media = media.iter().copied();
    let media = media.filter(|m| *m != partition.exterior && *m < parts.media.len());
    let of_medium = |medium| {
        let numbered = matters.own(medium).into_iter();
        numbered.filter_map(move |number| {
            let matter = matters.numbered(number);
            let held = CellMatter {
                matter: matter.clone(),
                medium,
            };
            matter.phase.is_uniform().then_some((number, held))
        })
    };
    media.flat_map(of_medium).collect()
}
