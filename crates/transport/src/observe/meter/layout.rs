//! Order of the cells of a meter.

/// Order of the cells of a meter: totals, then a row of values for each bin. The values of a bin lie
/// side by side in memory, because particles add to them together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CellLayout {
    /// Number of cells before the bins.
    pub totals: usize,
    /// Number of bins.
    pub bins: usize,
    /// Number of values of each bin.
    pub values: usize,
}

impl CellLayout {
    /// Returns the number of cells.
    pub(super) fn cells(&self) -> usize {
        self.bins
            .saturating_mul(self.values)
            .saturating_add(self.totals)
    }

    /// Returns the cells of a quantity that has `parts` values of each bin, from the value `first`
    /// on.
    pub(super) fn part(&self, first: usize, parts: usize) -> Cells {
        Cells {
            first: self.totals + first,
            stride: self.values,
            bins: self.bins,
            parts,
        }
    }
}

/// Cells of a quantity: its values of all bins, bin by bin; then the same for the next part, such as
/// the next frequency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cells {
    /// First cell among the cells of the meter.
    pub first: usize,
    /// Distance between the cells of two bins.
    pub stride: usize,
    /// Number of bins.
    pub bins: usize,
    /// Number of values of each bin. Their cells lie side by side.
    pub parts: usize,
}

impl Cells {
    /// Returns `count` cells side by side, which are bins of their own.
    pub(super) fn totals(first: usize, count: usize) -> Self {
        Cells {
            first,
            stride: 1,
            bins: count,
            parts: 1,
        }
    }

    /// Returns the number of cells.
    pub(super) fn count(&self) -> usize {
        self.bins.saturating_mul(self.parts)
    }

    /// Returns the cell with an index.
    pub(super) fn cell(&self, index: usize) -> usize {
        // Planted error "parts of a bin read from the next bin", found by morgana-transport/lib::observe::meter::layout::tests::quantities_share_the_cells:
        // self.first + (index % self.bins + index / self.bins) * self.stride
        self.first + index % self.bins * self.stride + index / self.bins
    }

    /// Returns the index of a cell; `None` if it belongs to another quantity.
    pub(super) fn index(&self, cell: usize) -> Option<usize> {
        let from = cell.checked_sub(self.first)?;
        let (bin, part) = (from / self.stride, from % self.stride);
        (bin < self.bins && part < self.parts).then(|| part * self.bins + bin)
    }

    /// Returns the cells at a distance in cells from these.
    pub(super) fn moved(self, distance: usize) -> Self {
        Cells {
            first: self.first + distance,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each cell belongs to one index of one quantity.
    #[test]
    fn quantities_share_the_cells() {
        let layout = CellLayout {
            totals: 4,
            bins: 7,
            values: 6,
        };
        let quantities = [
            Cells::totals(0, 2),
            Cells::totals(2, 2),
            layout.part(0, 1),
            layout.part(1, 3),
            layout.part(4, 2),
        ];
        let counts: usize = quantities.iter().map(Cells::count).sum();
        assert_eq!(counts, layout.cells());
        for cell in 0..layout.cells() {
            let owners = quantities.iter().filter_map(|cells| {
                let index = cells.index(cell)?;
                assert_eq!(cells.cell(index), cell);
                Some(index)
            });
            assert_eq!(owners.count(), 1, "{cell}");
        }
        assert_eq!(layout.part(0, 1).moved(4), layout.part(4, 1));
    }
}
