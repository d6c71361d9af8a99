//! Rays as text.

use serde_json::{Value, json};
use std::fmt::Write;
use transport::Scene;
use transport::trace::{Ending, Path};

/// One line per point.
pub fn csv(scene: &Scene, paths: &[Path]) -> String {
    let mut out = String::from("ray,point,x,y,z,dx,dy,dz,arc_length,opl,index,medium\n");
    for (i, path) in paths.iter().enumerate() {
        for (j, p) in path.points.iter().enumerate() {
            let ([x, y, z], [dx, dy, dz]) = (p.x.to_array(), p.direction.to_array());
            let (length, opl, index) = (p.arc_length, p.optical_length, p.index);
            let medium = quoted(&scene.medium(p.medium).name);
            // Writing to a string cannot fail.
            let _ = writeln!(
                out,
                "{i},{j},{x},{y},{z},{dx},{dy},{dz},{length},{opl},{index},{medium}"
            );
        }
    }
    out
}

/// A field as RFC 4180 wants it.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// One object per ray.
pub fn json(scene: &Scene, paths: &[Path]) -> Value {
    let rays: Vec<Value> = paths.iter().map(|path| ray(scene, path)).collect();
    json!({ "rays": rays })
}

fn ray(scene: &Scene, path: &Path) -> Value {
    let points: Vec<Value> = path
        .points
        .iter()
        .map(|p| {
            json!({
                "x": p.x.to_array(),
                "direction": p.direction.to_array(),
                "arc_length": p.arc_length,
                "opl": p.optical_length,
                "index": p.index,
                "medium": scene.medium(p.medium).name,
            })
        })
        .collect();
    let (end, surface) = match path.ending {
        Ending::Surface(object) => ("surface", Some(scene.objects()[object].name.as_str())),
        Ending::Left => ("left the scene", None),
        Ending::Length => ("maximum length", None),
        Ending::Lost => ("lost", None),
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
