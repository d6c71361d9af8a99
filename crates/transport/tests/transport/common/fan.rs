//! Number of rays between a point outside a ball and a point inside, by brute force. A dense fan of
//! rays in the plane of the two points and the centre is traced through an index that depends on
//! the radius alone.
//!
//! The code shares nothing with the library: it uses the classical Runge–Kutta method in the plane,
//! and counts the pairs of adjacent rays that enclose the point.

use glam::DVec2;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Rays on one side of the axis.
const RAYS: usize = 4000;
/// Steps along a diameter.
const STEPS: f64 = 300.0;

/// A ball around the origin, in surroundings of index 1.
pub struct RadialBall {
    pub radius: f64,
    /// n² as a function of the radius.
    pub n2: fn(f64) -> f64,
    /// dn²/dr as a function of the radius.
    pub slope: fn(f64) -> f64,
}

/// Rays from a point outside: for each, the radii along it, and the angles from the axis through
/// the point.
pub struct Fan(Vec<Vec<[f64; 2]>>);

impl Fan {
    /// Traces the fan from a point at a distance from the centre.
    pub fn new(ball: &RadialBall, distance: f64) -> Self {
        let ray = |i: usize| {
            let impact = ball.radius * ((i as f64 + 0.5) / RAYS as f64 * FRAC_PI_2).sin();
            let entry = (impact / distance).acos() - (impact / ball.radius).acos();
            ball.follow(impact, entry)
        };
        Fan((0..RAYS).map(ray).collect())
    }

    /// Counts the rays through a point at a radius and an angle in [0, π] from the axis.
    pub fn count(&self, radius: f64, angle: f64) -> usize {
        // Rays cross the radius for the first and for the last time on two curves, which meet where
        // rays are tangent to it.
        let mut met: Vec<[f64; 2]> = Vec::new();
        let mut touches = false;
        for ray in &self.0 {
            match crossings(ray, radius) {
                Some(pair) => met.push(pair),
                None => touches = true,
            }
        }
        let mut curves = [0, 1].map(|k| met.iter().map(|pair| pair[k]).collect::<Vec<f64>>());
        if touches {
            let back = std::mem::take(&mut curves[1]);
            curves[0].extend(back.into_iter().rev());
        }
        let around = [angle, TAU - angle];
        let passes = |curve: &Vec<f64>, goal: f64| {
            let between = |w: &&[f64]| (w[0] < goal) != (w[1] < goal);
            curve.windows(2).filter(between).count()
        };
        let each = |curve| around.iter().map(move |goal| passes(curve, *goal));
        curves.iter().flat_map(each).sum()
    }
}

/// Angles at which a ray first and last crosses a radius.
fn crossings(ray: &[[f64; 2]], radius: f64) -> Option<[f64; 2]> {
    let at = |w: &[[f64; 2]]| {
        let share = (radius - w[0][0]) / (w[1][0] - w[0][0]);
        w[0][1] + share * (w[1][1] - w[0][1])
    };
    let first = ray.windows(2).find(|w| w[1][0] <= radius)?;
    let last = ray.windows(2).rev().find(|w| w[0][0] <= radius)?;
    Some([at(first), at(last)])
}

impl RadialBall {
    /// Traces the ray of an impact parameter that enters at an angle from the axis, until it
    /// returns to the surface.
    fn follow(&self, impact: f64, entry: f64) -> Vec<[f64; 2]> {
        let n = (self.n2)(self.radius).sqrt();
        let sine = impact / (n * self.radius);
        let radial = DVec2::from_angle(entry);
        let mut x = radial * self.radius;
        let mut v = (radial.perp() * sine - radial * (1.0 - sine * sine).sqrt()) * n;
        let force = |x: DVec2| x * (0.5 * (self.slope)(x.length()) / x.length());
        let h = 2.0 * self.radius / (STEPS * n);
        let mut path = vec![[self.radius, entry]];
        let mut angle = entry;
        loop {
            let k1 = (v, force(x));
            let k2 = (v + k1.1 * (0.5 * h), force(x + k1.0 * (0.5 * h)));
            let k3 = (v + k2.1 * (0.5 * h), force(x + k2.0 * (0.5 * h)));
            let k4 = (v + k3.1 * h, force(x + k3.0 * h));
            let before = x;
            x += (k1.0 + (k2.0 + k3.0) * 2.0 + k4.0) * (h / 6.0);
            v += (k1.1 + (k2.1 + k3.1) * 2.0 + k4.1) * (h / 6.0);
            angle += before.angle_to(x);
            path.push([x.length(), angle]);
            if x.length() > self.radius {
                return path;
            }
        }
    }
}
