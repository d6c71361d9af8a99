//! Cells with labels: voxels, or tetrahedra.

use super::super::super::context::Context;
use super::super::super::division::{Division, LabelCounts, Places, SurfacesError};
use super::super::super::volume_source::SOURCE;
use super::tetrahedra::{self, PlacedTetrahedra};
use super::voxels::Voxels;
use crate::query::Query;
use crate::scene::ObjectDescription;

/// Name of the shape of tetrahedra.
const TETRAHEDRA: &str = "tetrahedra";

/// Cells of a volume, each with a label.
pub(super) enum Cells {
    Voxels(Voxels),
    Tetrahedra(PlacedTetrahedra),
}

/// Kind of the surfaces between the cells of different parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Options {
    /// Faces of voxels.
    Voxels,
    /// Smooth surfaces between voxels.
    Smooth,
    /// Faces of tetrahedra.
    Tetrahedra,
}

impl Options {
    /// Reads the options, and marks the parameters that [`Cells::read`] uses.
    pub(super) fn of(q: &mut Query) -> Self {
        if q.object().plugin == TETRAHEDRA {
            for known in tetrahedra::SOURCE {
                q.has(known);
            }
            return Options::Tetrahedra;
        }
        for known in SOURCE {
            q.has(known);
        }
        if q.word("surface") == "smooth" {
            Options::Smooth
        } else {
            Options::Voxels
        }
    }

    /// Returns true if labels of equal index share a medium, whose coefficients vary from voxel to
    /// voxel.
    pub(super) fn joins_labels(self) -> bool {
        self != Options::Tetrahedra
    }
}

impl Cells {
    /// Reads the cells of a shape; `None` after an error.
    pub(super) fn read(object: &ObjectDescription, context: &mut Context) -> Option<Self> {
        if object.plugin == TETRAHEDRA {
            return PlacedTetrahedra::read(object, context).map(Cells::Tetrahedra);
        }
        Voxels::read(object, context).map(Cells::Voxels)
    }

    /// Counts the cells of each label.
    pub(super) fn counts(&self) -> LabelCounts {
        match self {
            Cells::Voxels(voxels) => voxels.counts(),
            Cells::Tetrahedra(tetrahedra) => tetrahedra.counts(),
        }
    }

    /// Divides the volume into parts by the places of its labels.
    ///
    /// # Errors
    /// A place that has no inverse; a volume that is too thin or has too many voxels.
    pub(super) fn divide(
        self,
        places: &Places,
        options: Options,
    ) -> Result<Division, SurfacesError> {
        match self {
            Cells::Voxels(voxels) => voxels.divide(places, options == Options::Smooth),
            Cells::Tetrahedra(tetrahedra) => tetrahedra.divide(places),
        }
    }
}
