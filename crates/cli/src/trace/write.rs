//! Rays as text.

use serde_json::{Value, json};
use std::fmt::Write;
use transport::Scene;
use transport::trace::{Path, TraceEnding};

/// Number of significant digits on the screen. It is beyond the accuracy of curved rays, and hides
/// the rounding errors of straight ones.
const SCREEN_DIGITS: usize = 10;

/// Rounds a number for the screen.
fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", SCREEN_DIGITS - 1);
    text.parse().unwrap_or(value)
}

/// Returns a line per point; with a wavelength, optical path differences are also given in waves.
/// Numbers have all digits for a file, and fewer for the screen.
pub fn csv(scene: &Scene, paths: &[Path], wavelength: Option<f64>, is_file: bool) -> String {
    let shown = if is_file { |v| v } else { rounded };
    let waves = wavelength.map_or("", |_| ",waves");
    let mut out = format!("ray,point,x,y,z,dx,dy,dz,arc_length,opl,index,medium,opd{waves}\n");
    for (i, path) in paths.iter().enumerate() {
        for (j, p) in path.points.iter().enumerate() {
            let [x, y, z] = p.x.to_array().map(shown);
            let [dx, dy, dz] = p.direction.to_array().map(shown);
            let [length, opl, index] = [p.arc_length, p.optical_length, p.index].map(shown);
            let medium = quoted(&scene.medium(p.medium).name);
            let opd = shown(p.path_difference);
            let waves = wavelength.map(|w| format!(",{}", shown(p.path_difference / w)));
            let waves = waves.unwrap_or_default();
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "{i},{j},{x},{y},{z},{dx},{dy},{dz},{length},{opl},{index},{medium},{opd}{waves}"
            );
        }
    }
    out
}

/// Quotes a field as RFC 4180 requires.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// Returns an object per ray; with a wavelength, optical path differences are also given in waves.
pub fn json(scene: &Scene, paths: &[Path], wavelength: Option<f64>) -> Value {
    let ray = |path| ray(scene, path, wavelength);
    let rays: Vec<Value> = paths.iter().map(ray).collect();
    json!({ "rays": rays })
}

fn ray(scene: &Scene, path: &Path, wavelength: Option<f64>) -> Value {
    let points: Vec<Value> = path
        .points
        .iter()
        .map(|p| {
            let mut point = json!({
                "x": p.x.to_array(),
                "direction": p.direction.to_array(),
                "arc_length": p.arc_length,
                "opl": p.optical_length,
                "opd": p.path_difference,
                "index": p.index,
                "medium": scene.medium(p.medium).name,
            });
            if let Some(wavelength) = wavelength {
                point["waves"] = json!(p.path_difference / wavelength);
            }
            point
        })
        .collect();
    let (end, surface) = match path.ending {
        TraceEnding::Surface(object) => ("surface", Some(scene.objects()[object].name.as_str())),
        TraceEnding::Left => ("left the scene", None),
        TraceEnding::Length => ("maximum length", None),
        TraceEnding::Lost => ("lost", None),
    };
    json!({ "end": end, "surface": surface, "points": points })
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_screen_shows_no_rounding_errors() {
        for (value, text) in [
            (0.9999999999999999, "1"),
            (0.1 + 0.2, "0.3"),
            (-2.0000000000000004, "-2"),
            (1.0 / 3.0, "0.3333333333"),
            (12345.678901234567, "12345.6789"),
            (0.0, "0"),
        ] {
            assert_eq!(super::rounded(value).to_string(), text);
        }
        assert!(super::rounded(f64::NAN).is_nan());
        assert_eq!(super::rounded(f64::INFINITY), f64::INFINITY);
    }

    #[test]
    fn names_cannot_break_the_table() {
        assert_eq!(super::quoted("fog"), "fog");
        assert_eq!(super::quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
    }
}
