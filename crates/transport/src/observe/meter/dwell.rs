//! Dwell: the fluence of a particle in a cell, until it reaches another cell.
//!
//! Consecutive pieces of the particle's path in one cell share the modulation of one piece, chosen
//! at random in proportion to the fluence. The phase shift from sound hardly changes within a cell,
//! and computing the parts of light takes longer than tracing the path.

use crate::Spectrum;
use glam::DVec2;

/// Maximum number of pieces with one modulation. Large cells then do not depend on too few
/// modulations.
const MAX_PIECES: u32 = 8;

/// Fluence in a cell, with the modulation of one of its pieces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dwell {
    /// Bin of the cell.
    pub bin: usize,
    pub fluence: Spectrum,
    pub modulation: DVec2,
    pieces: u32,
}

impl Dwell {
    /// Creates a dwell from the first piece in a cell.
    pub(super) fn new(bin: usize, fluence: Spectrum, modulation: DVec2) -> Self {
        Dwell {
            bin,
            fluence,
            modulation,
            pieces: 1,
        }
    }

    /// Returns true if another piece in a bin can be added. With several channels each piece keeps
    /// its own modulation, because pieces may differ in colour.
    pub(super) fn continues(&self, bin: usize, channels: usize) -> bool {
        self.bin == bin && self.pieces < MAX_PIECES && channels == 1
    }

    /// Adds a piece. The random number `u` in [0, 1) chooses between the pieces, and then samples
    /// the modulation.
    pub(super) fn add(&mut self, fluence: Spectrum, u: f64, modulation: impl FnOnce(f64) -> DVec2) {
        self.fluence += fluence;
        self.pieces += 1;
        let (all, of_piece) = (u * self.fluence[0], fluence[0]);
        if all < of_piece {
            // Rescale the random number: it is again uniform in [0, 1).
            self.modulation = modulation(all / of_piece);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::Rng;

    /// Pieces are chosen by their fluence, at evenly spread points. Five standard errors give false
    /// alarms with probability 1e-5.
    #[test]
    fn pieces_stand_for_all_in_proportion() {
        let (mut rng, number) = (Rng::new(3), 100_000);
        let fluence = [1.0, 0.0, 5.0, 2.0];
        let mut chosen = [[0.0; 3]; 4];
        for _ in 0..number {
            let at = |piece: usize| move |u: f64| DVec2::new(piece as f64, u);
            let first = at(0)(rng.next_1d());
            let mut dwell = Dwell::new(7, Spectrum::from(fluence[0]), first);
            for (piece, fluence) in fluence.into_iter().enumerate().skip(1) {
                assert!(dwell.continues(7, 1) && !dwell.continues(8, 1) && !dwell.continues(7, 3));
                dwell.add(Spectrum::from(fluence), rng.next_1d(), at(piece));
            }
            assert_eq!(dwell.fluence[0], 8.0);
            let u = dwell.modulation.y;
            let sums = &mut chosen[dwell.modulation.x as usize];
            *sums = [sums[0] + 1.0, sums[1] + u, sums[2] + u * u];
        }
        for ([count, sum, squares], fluence) in chosen.into_iter().zip(fluence) {
            let p = fluence / 8.0;
            let n = f64::from(number);
            assert!((count - n * p).abs() <= 5.0 * (n * p * (1.0 - p)).sqrt());
            if p > 0.0 {
                assert!((sum / count - 0.5).abs() < 5.0 * (1.0 / 12.0 / count).sqrt());
                assert!((squares / count - 1.0 / 3.0).abs() < 5.0 * (4.0 / 45.0 / count).sqrt());
            }
        }
    }

    #[test]
    fn dwells_are_of_few_pieces() {
        let mut dwell = Dwell::new(0, Spectrum::ONE, DVec2::ZERO);
        while dwell.continues(0, 1) {
            dwell.add(Spectrum::ONE, 0.5, |_| DVec2::ZERO);
        }
        assert_eq!((dwell.fluence[0], dwell.pieces), (8.0, MAX_PIECES));
    }
}
