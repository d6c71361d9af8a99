//! Rays as text.

use serde_json::{Value, json};
use std::fmt::Write;
use transport::Scene;
use transport::trace::{Path, TraceEnding};

/// Returns a line per point; with a wavelength, optical path differences are also given in waves.
pub fn csv(scene: &Scene, paths: &[Path], wavelength: Option<f64>) -> String {
    let waves = wavelength.map_or("", |_| ",waves");
    let mut out = format!("ray,point,x,y,z,dx,dy,dz,arc_length,opl,index,medium,opd{waves}\n");
    for (i, path) in paths.iter().enumerate() {
        for (j, p) in path.points.iter().enumerate() {
            let ([x, y, z], [dx, dy, dz]) = (p.x.to_array(), p.direction.to_array());
            let (length, opl, index) = (p.arc_length, p.optical_length, p.index);
            let medium = quoted(&scene.medium(p.medium).name);
            let opd = p.path_difference;
            let waves = wavelength.map_or(String::new(), |w| format!(",{}", opd / w));
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
    fn names_cannot_break_the_table() {
        assert_eq!(super::quoted("fog"), "fog");
        assert_eq!(super::quoted("a,\"b\""), "\"a,\"\"b\"\"\"");
    }
}
