//! A light search for all rays between two points.

use glam::DVec3;
use morgana_eikonal::certificate::Uniqueness;
use morgana_eikonal::connect::{InitialGuess, Pattern, RayFamily, Unbounded};
use morgana_eikonal::ray::perpendicular_basis;
use morgana_eikonal::{Field, Solver, Tolerance};

/// Finds the directions at `x` of all rays to `y` that stay `inside`. Newton's method starts from
/// `starts` directions all over the cap of half-angle `cap` around the chord.
pub fn all_rays(
    field: &Field,
    [x, y]: [DVec3; 2],
    (starts, cap): (usize, f64),
    inside: impl Fn(DVec3) -> bool,
) -> Vec<DVec3> {
    let mut solver = Solver::new(Tolerance::new(1e-7));
    let chord = (y - x).normalize();
    let [t1, t2] = perpendicular_basis(chord);
    let mut found: Vec<DVec3> = Vec::new();
    for i in 0..starts {
        // Directions of equal solid angle, on a Fibonacci spiral.
        let z = 1.0 - (1.0 - cap.cos()) * (i as f64 + 0.5) / starts as f64;
        let (r, phi) = ((1.0 - z * z).sqrt(), i as f64 * 2.399_963_229_728_653);
        let direction = chord * z + (t1 * phi.cos() + t2 * phi.sin()) * r;
        // Try several lengths, because rays between distant points differ in length.
        let start = InitialGuess {
            family: RayFamily::Point { x, direction },
            region: (),
            optical_length: x.distance(y) * field.n(x) * [1.0, 1.15, 1.4][i % 3],
            pattern: Pattern::REFRACT,
        };
        let Ok(ray) = solver.solve(&Unbounded(field), &start, y) else {
            continue;
        };
        let mut points = solver.pieces().iter().flat_map(|piece| {
            (1..=4).map(|k| piece.arc.position(piece.theta_end * f64::from(k) / 4.0))
        });
        // Rays whose directions differ by at most 1e-4 count as one: near a caustic the solver's
        // tolerance leaves 1e-6.
        let new = found.iter().all(|d| d.distance(ray.direction_out) > 1e-4);
        if new && points.all(|p| p.distance(y) < 1e-6 || inside(p)) {
            found.push(ray.direction_out);
        }
    }
    found
}

/// Half-angle to the chord that contains the start of every ray that stays inside: the angle for
/// the circle of the largest curvature (Schur's theorem), with a margin.
pub fn cap(certificate: &Uniqueness, d: f64) -> f64 {
    (0.5 * certificate.bounds().kappa() * d).min(1.0).asin() + 0.05
}
