//! Formats of volumes.

use crate::element::Element;
use crate::error::Problem;
use std::path::Path;

/// A format of volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Mitsuba's grids.
    Vol,
    /// An array of NumPy.
    Npy,
    /// Arrays of NumPy.
    Npz,
    /// HDF5.
    Hdf5,
    /// MATLAB, version 5.
    Mat,
    /// Nearly raw raster data.
    Nrrd,
    /// VTK's XML image data.
    Vti,
    /// VTK's structured points.
    Vtk,
    /// OpenVDB; read only.
    Vdb,
    /// NIfTI, perhaps compressed; read only.
    Nifti,
}

impl Format {
    /// By a file's extension.
    pub fn of(path: &Path) -> Option<Format> {
        let name = path.file_name()?.to_str()?.to_ascii_lowercase();
        if name.ends_with(".nii.gz") {
            return Some(Format::Nifti);
        }
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "vol" => Format::Vol,
            "npy" => Format::Npy,
            "npz" => Format::Npz,
            "h5" | "hdf5" => Format::Hdf5,
            "mat" => Format::Mat,
            "nrrd" | "nhdr" => Format::Nrrd,
            "vti" => Format::Vti,
            "vtk" => Format::Vtk,
            "vdb" => Format::Vdb,
            "nii" => Format::Nifti,
            _ => return None,
        })
    }

    /// What is wrong with a file of another extension.
    pub fn unknown() -> Problem {
        let message = "volumes are .vol, .npy, .npz, .h5, .hdf5, .mat, .nrrd, .nhdr, .vti and .vtk, and .vdb, \
                       .nii and .nii.gz to read; meshes (.vtu, .vtr, .vts, .vtm, .foam, .cgns) are resampled by \
                       python -m morgana.flow";
        Problem::Unsupported(message.into())
    }

    /// Whether the user must say which axis of an array is which. An NRRD file may say so itself.
    pub fn needs_axis_order(self) -> bool {
        matches!(self, Format::Npy | Format::Npz | Format::Hdf5 | Format::Mat)
    }

    /// Whether the format itself says which axis is which.
    pub fn has_axis_order(self) -> bool {
        matches!(
            self,
            Format::Vol | Format::Vti | Format::Vtk | Format::Vdb | Format::Nifti
        )
    }

    /// Whether it is only read.
    pub fn is_read_only(self) -> bool {
        matches!(self, Format::Vdb | Format::Nifti)
    }

    /// Whether a file may hold several volumes.
    pub fn has_datasets(self) -> bool {
        matches!(
            self,
            Format::Npz | Format::Hdf5 | Format::Mat | Format::Vti | Format::Vtk | Format::Vdb
        )
    }

    /// The type of numbers that is written for one of the given type: the same if the format has it, else
    /// the next that holds them. `.vol` has floating-point numbers of 16 and 32 bits only.
    pub fn element(self, element: Element) -> Element {
        match (self, element) {
            (Format::Npy | Format::Npz, _) => element,
            (Format::Vol, Element::F16 | Element::F32) => element,
            (Format::Vol, _) | (_, Element::F16) => Element::F32,
            _ => element,
        }
    }
}
