//! A light search for all rays between two points.

use glam::DVec3;
use morgana_eikonal::certificate::Uniqueness;
use morgana_eikonal::connect::{InitialGuess, Pattern, RayFamily, Unbounded};
use morgana_eikonal::ray::perpendicular_basis;
use morgana_eikonal::{Field, Solver, Tolerance};

/// The directions at `x` of all rays to `y` that stay `inside`, found by Newton's method from
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
        // A Fibonacci spiral of equal areas.
        let z = 1.0 - (1.0 - cap.cos()) * (i as f64 + 0.5) / starts as f64;
        let (r, phi) = ((1.0 - z * z).sqrt(), i as f64 * 2.399_963_229_728_653);
        let direction = chord * z + (t1 * phi.cos() + t2 * phi.sin()) * r;
        // Rays between distant points come in lengths of their own.
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
        // Rays that differ by 1e-4 are one: the solver's tolerance leaves 1e-6 near a caustic.
        let new = found.iter().all(|d| d.distance(ray.direction_out) > 1e-4);
        if new && points.all(|p| p.distance(y) < 1e-6 || inside(p)) {
            found.push(ray.direction_out);
        }
    }
    found
}

/// Half-angle to the chord within which every ray starts that stays inside: that of the circle of
/// the largest curvature (Schur), and a little more.
pub fn cap(certificate: &Uniqueness, d: f64) -> f64 {
    (0.5 * certificate.bounds().kappa() * d).min(1.0).asin() + 0.05
}
