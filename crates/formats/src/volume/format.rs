//! Volume file formats.

use crate::element::Element;
use crate::error::Problem;
use std::path::Path;

/// Volume file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Grid of Mitsuba.
    Vol,
    /// NumPy array.
    Npy,
    /// Archive of NumPy arrays.
    Npz,
    /// HDF5 file.
    Hdf5,
    /// MATLAB file, version 5.
    Mat,
    /// Nearly raw raster data (NRRD).
    Nrrd,
    /// XML image data of VTK.
    Vti,
    /// Structured points of VTK.
    Vtk,
    /// OpenVDB file; read only.
    Vdb,
    /// NIfTI file, also compressed.
    Nifti,
    /// JNIfTI file, as text or binary.
    Jnifti,
    /// JData file of arrays, as text or binary.
    Jdata,
}

impl Format {
    /// Returns the format of a file's extension.
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
            "jnii" | "bnii" => Format::Jnifti,
            "jdt" | "jdat" | "jdb" | "bjd" => Format::Jdata,
            _ => return None,
        })
    }

    /// Makes an error for a file with another extension.
    pub fn unknown() -> Problem {
        let message = "volumes are .vol, .npy, .npz, .h5, .hdf5, .mat, .nrrd, .nhdr, .vti, .vtk, .nii, .nii.gz, .jnii, .bnii, .jdt \
                       and .jdb, and .vdb to read; meshes (.vtu, .vtr, .vts, .vtm, .foam, .cgns) are resampled by \
                       python -m morgana.flow";
        Problem::Unsupported(message.into())
    }

    /// Returns true if the user must give the order of axes. An NRRD file may state it itself.
    pub fn needs_axis_order(self) -> bool {
        matches!(
            self,
            Format::Npy | Format::Npz | Format::Hdf5 | Format::Mat | Format::Jdata
        )
    }

    /// Returns true if the format itself defines the order of axes.
    pub fn has_axis_order(self) -> bool {
        matches!(
            self,
            Format::Vol | Format::Vti | Format::Vtk | Format::Vdb | Format::Nifti | Format::Jnifti
        )
    }

    /// Returns true for formats that are only read.
    pub fn is_read_only(self) -> bool {
        matches!(self, Format::Vdb)
    }

    /// Returns true if a file may contain several volumes.
    pub fn has_datasets(self) -> bool {
        matches!(
            self,
            Format::Npz
                | Format::Hdf5
                | Format::Mat
                | Format::Vti
                | Format::Vtk
                | Format::Vdb
                | Format::Jdata
        )
    }

    /// Returns the number type that is written for a given type: the same type if the format has
    /// it, else the next that represents its numbers. `.vol` has only floating-point numbers of 16
    /// and 32 bits.
    pub fn element(self, element: Element) -> Element {
        match (self, element) {
            (Format::Npy | Format::Npz, _) => element,
            (Format::Vol, Element::F16 | Element::F32) => element,
            (Format::Vol, _) | (_, Element::F16) => Element::F32,
            _ => element,
        }
    }
}
