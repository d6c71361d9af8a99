//! Starts of a fan of rays.

use eikonal::ray::perpendicular_basis;
use glam::DVec3;

/// Returns `rays` starts (position, unit direction) in a plane, around a central one. Positions are
/// spaced evenly over `width` across the direction, directions evenly over `spread` radians.
///
/// The plane contains the direction and the coordinate axis y, or x if the direction is nearly
/// along y.
pub fn fan(
    from: DVec3,
    direction: DVec3,
    rays: usize,
    spread: f64,
    width: f64,
) -> Vec<(DVec3, DVec3)> {
    let axis = if direction.y.abs() > 0.9 {
        DVec3::X
    } else {
        DVec3::Y
    };
    let across = (axis - direction * axis.dot(direction)).try_normalize();
    let across = across.unwrap_or(perpendicular_basis(direction)[0]);
    (0..rays)
        .map(|i| {
            let t = match rays {
                1 => 0.0,
                _ => i as f64 / (rays - 1) as f64 - 0.5,
            };
            let (sin, cos) = (spread * t).sin_cos();
            (from + across * (width * t), direction * cos + across * sin)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_lie_evenly_around_the_middle_one() {
        let starts = fan(DVec3::ZERO, DVec3::X, 3, 1.0, 2.0);
        assert_eq!(starts[1], (DVec3::ZERO, DVec3::X));
        assert_eq!(starts[0].0, -DVec3::Y);
        assert!((starts[2].1.angle_between(DVec3::X) - 0.5).abs() < 1e-12);
        let [(x, d)] = fan(DVec3::ONE, DVec3::Y, 1, 1.0, 1.0)[..] else {
            panic!("one ray");
        };
        assert_eq!((x, d), (DVec3::ONE, DVec3::Y));
    }
}
