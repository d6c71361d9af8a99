//! Path of least optical length between two points, as a chain of straight pieces. Newton's method
//! starts from it if it does not converge from the chord.
//!
//! Near a steep change of the index, rays traced along the chord may be reflected totally, and miss
//! the target by any distance. A shortest path always exists (Fermat). Its nodes are evenly spaced
//! along the chord. Newton's method finds their displacements across it, by minimising the sum of
//! the lengths of the pieces, each times the index at its middle. Damping makes every step a
//! descent step. The matrix is block tridiagonal.
//!
//! Theory: docs/theory.md#the-shortest-path.

use super::bend::{BentChord, Guess};
use crate::field::Field;
use crate::ray::perpendicular_basis;
use glam::{DMat2, DVec2, DVec3};

/// Number of pieces of the chain. Across a lens each piece is a small part, across the finest grids
/// a few cells.
const PIECES: usize = 64;
/// Maximum number of steps.
const MAX_STEPS: usize = 40;
/// Largest move of a node at convergence, as a fraction of the chord.
const MAX_LAST_MOVE: f64 = 1e-7;
/// Damping, in units of the index over the length of a piece: initial value, factor after a step
/// that did not descend, factor after a step that did, and maximum.
const DAMPING: (f64, f64, f64, f64) = (1e-3, 8.0, 0.125, 1e6);

/// Displacements of the nodes.
type Shape = [DVec2; PIECES + 1];

/// The chord and the field along it.
struct Chain<'a> {
    field: &'a Field,
    line: &'a BentChord,
    /// Unit vectors across the chord.
    across: [DVec3; 2],
    /// Index before and after the bending part.
    outside: [f64; 2],
    /// Length of a piece of the chord.
    piece: f64,
    /// The first node that may move.
    first: usize,
    evaluations: u64,
}

/// Optical length of the chain and its derivatives.
struct System {
    length: f64,
    gradient: Shape,
    diagonal: [DMat2; PIECES + 1],
    /// Second derivatives by a node and the next node.
    next: [DMat2; PIECES],
}

/// Finds the shortest path from the line's first point or, if `is_plane`, from the plane across it.
/// `None` if the iteration does not converge.
pub(super) fn shortest(field: &Field, line: &BentChord, is_plane: bool) -> Option<Guess> {
    let d = line.chord.length();
    let index = |optical: f64, share: f64| {
        if share > 0.0 {
            optical / (share * d)
        } else {
            1.0
        }
    };
    let mut chain = Chain {
        field,
        line,
        across: perpendicular_basis(line.chord / d),
        outside: [
            index(line.optical[0], line.part[0]),
            index(line.optical[1], 1.0 - line.part[1]),
        ],
        piece: d / PIECES as f64,
        first: usize::from(!is_plane),
        evaluations: 0,
    };
    // Take damped Newton steps; reject steps that lengthen the path.
    let mut shape = [DVec2::ZERO; PIECES + 1];
    let mut system = chain.system(&shape);
    let (mut damping, growth, decay, most) = DAMPING;
    for _ in 0..MAX_STEPS {
        let step = chain.step(&system, damping);
        let next = step.map(|step| std::array::from_fn(|i| shape[i] + step[i]));
        let there = next.as_ref().map(|next| chain.system(next));
        match (step, next, there) {
            (Some(step), Some(next), Some(there)) if there.length <= system.length => {
                (shape, system) = (next, there);
                damping *= decay;
                if step.iter().all(|s| s.length() <= MAX_LAST_MOVE * d) {
                    return Some(chain.guess(&shape, system.length, is_plane));
                }
            }
            _ => damping *= growth,
        }
        if damping > most {
            return None;
        }
    }
    None
}

impl Chain<'_> {
    fn node(&self, shape: &Shape, i: usize) -> DVec3 {
        self.line.x
            + self.line.chord * (i as f64 / PIECES as f64)
            + self.across[0] * shape[i].x
            + self.across[1] * shape[i].y
    }

    /// Returns the index at the middle of a piece, with its derivatives across the chord.
    fn index(&mut self, shape: &Shape, i: usize) -> (f64, DVec2, DMat2) {
        let along = (i as f64 + 0.5) / PIECES as f64;
        let [begin, end] = self.line.part;
        if along < begin || along > end {
            let n = self.outside[usize::from(along > end)];
            return (n, DVec2::ZERO, DMat2::ZERO);
        }
        self.evaluations += 1;
        let jet = self
            .field
            .jet(0.5 * (self.node(shape, i) + self.node(shape, i + 1)));
        let n = jet.n2.max(f64::MIN_POSITIVE).sqrt();
        let [a, b] = self.across;
        let slope = DVec2::new(jet.grad.dot(a), jet.grad.dot(b)) / (2.0 * n);
        let [ha, hb] = [jet.hess * a, jet.hess * b];
        let hess = DMat2::from_cols(
            DVec2::new(ha.dot(a), ha.dot(b)),
            DVec2::new(hb.dot(a), hb.dot(b)),
        );
        (n, slope, (hess - 2.0 * outer(slope, slope)) * (0.5 / n))
    }

    fn system(&mut self, shape: &Shape) -> System {
        let mut system = System {
            length: 0.0,
            gradient: [DVec2::ZERO; PIECES + 1],
            diagonal: [DMat2::ZERO; PIECES + 1],
            next: [DMat2::ZERO; PIECES],
        };
        for i in 0..PIECES {
            let (n, slope, hess) = self.index(shape, i);
            let e = shape[i + 1] - shape[i];
            let length = (self.piece * self.piece + e.length_squared()).sqrt();
            let e = e / length;
            let stretch = (DMat2::IDENTITY - outer(e, e)) * (n / length);
            let [turn, back] = [outer(e, slope) * 0.5, outer(slope, e) * 0.5];
            let bend = hess * (0.25 * length);
            system.length += n * length;
            system.gradient[i] += slope * (0.5 * length) - e * n;
            system.gradient[i + 1] += slope * (0.5 * length) + e * n;
            system.diagonal[i] += stretch - turn - back + bend;
            system.diagonal[i + 1] += stretch + turn + back + bend;
            system.next[i] = bend - stretch + back - turn;
        }
        system
    }

    /// Returns Newton's step with damping; `None` if it does not lead to a minimum.
    fn step(&self, system: &System, damping: f64) -> Option<Shape> {
        let mut pivots = [DMat2::ZERO; PIECES];
        let mut step = [DVec2::ZERO; PIECES + 1];
        let damping = DMat2::IDENTITY * (damping / self.piece);
        for i in self.first..PIECES {
            let mut pivot = system.diagonal[i] + damping;
            step[i] = -system.gradient[i];
            if i > self.first {
                let eliminate = system.next[i - 1].transpose() * pivots[i - 1];
                pivot -= eliminate * system.next[i - 1];
                step[i] -= eliminate * step[i - 1];
            }
            if !(pivot.x_axis.x > 0.0 && pivot.determinant() > 0.0) {
                return None;
            }
            pivots[i] = pivot.inverse();
        }
        for i in (self.first..PIECES).rev() {
            let after = if i + 1 < PIECES {
                system.next[i] * step[i + 1]
            } else {
                DVec2::ZERO
            };
            step[i] = pivots[i] * (step[i] - after);
        }
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    fn guess(&self, shape: &Shape, optical_length: f64, is_plane: bool) -> Guess {
        let [start, second] = [0, 1].map(|i| self.node(shape, i));
        Guess {
            direction: (second - start).normalize(),
            offset: if is_plane {
                start - self.line.x
            } else {
                DVec3::ZERO
            },
            optical_length,
            evaluations: self.evaluations,
        }
    }
}

/// Returns abᵀ.
fn outer(a: DVec2, b: DVec2) -> DMat2 {
    DMat2::from_cols(a * b.x, a * b.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::LinearSquare;

    /// In n² = a + b·x rays are parabolas, x + vσ + bσ²/4. The relative error of a chain with
    /// pieces of length h is about (h/d)².
    #[test]
    fn the_shortest_path_along_a_parabola_is_found() {
        let slope = DVec3::new(0.8, -0.9, 0.3);
        let field: Field = LinearSquare::new(1.4, slope, DVec3::ZERO).unwrap().into();
        let (x, direction) = (DVec3::new(0.1, 0.2, -0.1), DVec3::new(0.6, 0.0, 0.8));
        let (v, sigma) = (direction * field.n(x), 0.7);
        let y = x + v * sigma + slope * (0.25 * sigma * sigma);
        let n2 = |s: f64| field.n2(x + v * s + slope * (0.25 * s * s));
        // Simpson's rule is exact for n² along a parabola, quadratic in σ.
        let optical = sigma / 6.0 * (n2(0.0) + 4.0 * n2(0.5 * sigma) + n2(sigma));
        let line = BentChord {
            x,
            chord: y - x,
            part: [0.0, 1.0],
            optical: [0.0; 2],
        };
        let found = shortest(&field, &line, false).unwrap();
        assert!((found.optical_length / optical - 1.0).abs() < 1e-4);
        assert!(found.direction.distance(direction) < 5e-3);
    }
}
