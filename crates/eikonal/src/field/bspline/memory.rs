//! Memory of coefficients.

use super::lattice::{Lattice, Layout};
use memmap2::MmapMut;
use std::ops::Deref;

/// Coefficients of a grid in their final order.
#[derive(Debug)]
pub(super) enum Coefficients {
    /// Coefficients in the memory of the samples.
    Vector(Vec<f32>),
    /// Coefficients in separate memory, on the largest pages that the system provides. With small
    /// pages, evaluations far apart in a large grid would wait for the translation of addresses.
    Pages(MmapMut),
}

impl Coefficients {
    /// Rearranges coefficients from rows to their final order.
    pub(super) fn new(lattice: &Lattice, mut rows: Vec<f32>) -> Self {
        if lattice.layout() == Layout::Rows {
            return Coefficients::Vector(rows);
        }
        let slab = lattice.slab();
        let Some(mut pages) = large_pages(size_of_val(rows.as_slice())) else {
            for planes in rows.chunks_exact_mut(slab) {
                let copy = planes.to_vec();
                lattice.arrange(&copy, planes);
            }
            return Coefficients::Vector(rows);
        };
        // Start from the end, so that the memory of the rows is freed as the memory of the columns
        // fills.
        let columns = bytemuck::cast_slice_mut(&mut pages);
        for to in columns.chunks_exact_mut(slab).rev() {
            let rest = rows.len() - slab;
            lattice.arrange(&rows[rest..], to);
            rows.truncate(rest);
            rows.shrink_to_fit();
        }
        Coefficients::Pages(pages)
    }
}

impl Deref for Coefficients {
    type Target = [f32];

    #[inline]
    fn deref(&self) -> &[f32] {
        match self {
            Coefficients::Vector(all) => all,
            Coefficients::Pages(pages) => bytemuck::cast_slice(pages),
        }
    }
}

/// Allocates `bytes` bytes of zeroed memory; `None` if the allocation fails.
fn large_pages(bytes: usize) -> Option<MmapMut> {
    let pages = MmapMut::map_anon(bytes).ok()?;
    // Ignore errors: small pages also work.
    #[cfg(target_os = "linux")]
    let _ = pages.advise(memmap2::Advice::HugePage);
    Some(pages)
}
