//! `morgana trace`.

use crate::support::Folder;
use serde_json::Value;

const BEAM: &str = "trace scene.xml --from=-2,0,0 --direction 1,0,0 --rays 9 --width 1.6";

fn rays(folder: &Folder, arguments: &str) -> Vec<Value> {
    folder.succeed(&format!("{arguments} -o rays.json"));
    folder.json("rays.json")["rays"].as_array().unwrap().clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_lens_focuses_parallel_rays_on_its_far_pole() {
    let rays = rays(&Folder::with_lens(), BEAM);
    assert_eq!(rays.len(), 9);
    for ray in rays {
        assert_eq!(ray["end"], "left the scene");
        let points = ray["points"].as_array().unwrap();
        let inside = points.iter().rposition(|p| p["medium"] == "glass").unwrap();
        let exit = &points[inside + 1]["x"];
        assert!((number(&exit[0]) - 1.0).abs() < 1e-5, "{exit}");
        assert!(
            number(&exit[1]).abs() < 1e-4 && number(&exit[2]).abs() < 1e-9,
            "{exit}"
        );
    }
}

#[test]
fn csv_goes_to_the_standard_output() {
    let folder = Folder::with_lens();
    let text = folder.succeed(BEAM);
    let mut lines = text.lines();
    let header = "ray,point,x,y,z,dx,dy,dz,arc_length,opl,index,medium,opd";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    assert!(rows.len() > 50 && rows.iter().all(|r| r.len() == 13));
    assert_eq!(rows.last().unwrap()[0], "8");
    folder.succeed(&format!("{BEAM} -o rays.csv"));
    let file = String::from_utf8(folder.read("rays.csv")).unwrap();
    assert_eq!(file.lines().count(), text.lines().count());
    // The file has all digits, the screen ten of them.
    let digits = |field: &str| {
        field
            .trim_start_matches(['-', '0', '.'])
            .replace('.', "")
            .len()
    };
    let most = |text: &str| {
        let fields = text.lines().skip(1).flat_map(|line| line.split(','));
        fields
            .filter(|f| f.parse::<f64>().is_ok())
            .map(digits)
            .max()
    };
    assert_eq!(most(&text), Some(10));
    assert!(most(&file) > Some(14));
    for (shown, written) in text.lines().zip(file.lines()).skip(1) {
        for (shown, written) in shown.split(',').zip(written.split(',')) {
            let (Ok(shown), Ok(written)) = (shown.parse::<f64>(), written.parse::<f64>()) else {
                assert_eq!(shown, written);
                continue;
            };
            assert!(
                (shown - written).abs() <= 1e-9 * written.abs(),
                "{shown} {written}"
            );
        }
    }
}

#[test]
fn indices_and_lengths_are_those_of_the_field() {
    let text = Folder::with_lens().succeed(BEAM);
    let mut last = (String::new(), [0.0; 3], 0.0);
    for line in text.lines().skip(1) {
        let row: Vec<&str> = line.split(',').collect();
        let value = |i: usize| row[i].parse::<f64>().unwrap();
        let x: [f64; 3] = [2, 3, 4].map(value);
        let r2: f64 = x.iter().map(|v| v * v).sum();
        let expected = if row[11] == "glass" {
            (2.0 - r2).sqrt()
        } else {
            1.0
        };
        assert!((value(10) - expected).abs() < 1e-5, "{line}");
        let chord = x
            .iter()
            .zip(last.1)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt();
        let arc = value(8) - last.2;
        if last.0 == row[0] {
            assert!(arc >= chord * (1.0 - 1e-7) && arc < chord * 1.01, "{line}");
        }
        last = (row[0].to_owned(), x, value(8));
    }
}

#[test]
fn rays_are_refracted_totally_reflected_and_stopped() {
    let folder = Folder::with_scene(
        r#"<shape type="cube"><bsdf type="dielectric">
             <float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
           </bsdf></shape>
           <shape type="rectangle" id="screen"><transform name="to_world">
             <scale value="9"/><translate z="3"/></transform></shape>"#,
    );
    let refracted = &rays(&folder, "trace scene.xml --from 0,-1,-2 --direction 0,1,1")[0];
    let sin = number(&refracted["points"][1]["direction"][1]);
    assert!((sin - 0.5f64.sqrt() / 1.5).abs() < 1e-9, "{sin}");
    assert_eq!(
        (&refracted["end"], &refracted["surface"]),
        (&"surface".into(), &"screen".into())
    );
    // Start inside, at 60° to the normal of the upper side, beyond the critical angle of 42°.
    let reflected = &rays(
        &folder,
        "trace scene.xml --from 0,0.5,0 --direction 0,0.5,0.866",
    )[0];
    assert!(number(&reflected["points"][1]["direction"][1]) < -0.49);
}

#[test]
fn a_length_can_be_set() {
    let ray = &rays(
        &Folder::with_lens(),
        "trace scene.xml --from=-2,0.3,0 --direction 1,0,0 --max-length 2",
    )[0];
    assert_eq!(ray["end"], "maximum length");
    let last = ray["points"].as_array().unwrap().last().unwrap();
    assert!((number(&last["arc_length"]) - 2.0).abs() < 1e-9, "{last}");
}

#[test]
fn a_fan_spreads() {
    let fan = "trace scene.xml --from=-2,0,0 --direction 1,0,0 --rays 3 --spread 60";
    let rays = rays(&Folder::with_fog(), fan);
    let sines: Vec<f64> = rays
        .iter()
        .map(|r| number(&r["points"][0]["direction"][1]))
        .collect();
    for (sin, expected) in sines.iter().zip([-0.5, 0.0, 0.5]) {
        assert!((sin - expected).abs() < 1e-12, "{sines:?}");
    }
}

#[test]
fn the_plot_is_a_well_formed_document() {
    let folder = Folder::with_lens();
    folder.succeed(&format!("{BEAM} -o rays.svg"));
    let text = String::from_utf8(folder.read("rays.svg")).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let count = |name: &str| {
        document
            .descendants()
            .filter(|n| n.has_tag_name(name))
            .count()
    };
    assert_eq!(document.root_element().tag_name().name(), "svg");
    assert_eq!(count("polyline"), 9);
    // The index as an image, and the gradient of the colour bar.
    assert_eq!((count("image"), count("linearGradient")), (1, 1));
    assert!(text.contains("section at z = 0"));
    assert!(text.contains("<path d=\"M"), "the outline of the lens");
}

#[test]
fn a_plot_without_anything_but_one_ray_is_a_plot() {
    let folder = Folder::with_scene("");
    folder.succeed("trace scene.xml --from 0,0,0 --direction 0,0,1 -o rays.svg");
    let text = String::from_utf8(folder.read("rays.svg")).unwrap();
    assert!(roxmltree::Document::parse(&text).is_ok());
    assert!(!text.contains("NaN") && !text.contains("inf"));
}

/// Positions of all rays in the table.
fn positions(folder: &Folder) -> Vec<(String, [f64; 3])> {
    folder.succeed(&format!("{BEAM} -o table.csv"));
    let text = String::from_utf8(folder.read("table.csv")).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let row: Vec<&str> = line.split(',').collect();
        (
            row[0].to_owned(),
            [2, 3, 4].map(|i| row[i].parse().unwrap()),
        )
    });
    rows.collect()
}

fn numbers(line: &str) -> Vec<f64> {
    line.split_whitespace()
        .filter_map(|w| w.parse().ok())
        .collect()
}

#[test]
fn lines_of_obj_files_are_the_rays() {
    let folder = Folder::with_lens();
    let table = positions(&folder);
    folder.succeed(&format!("{BEAM} -o rays.obj"));
    let text = String::from_utf8(folder.read("rays.obj")).unwrap();
    let lines = |start: &'static str| {
        text.lines()
            .filter_map(move |l| l.strip_prefix(start))
            .map(numbers)
    };
    let vertices: Vec<Vec<f64>> = lines("v ").collect();
    assert!(vertices.iter().zip(&table).all(|(v, (_, x))| v == x));
    let mut next = 1.0;
    for (ray, line) in lines("l ").enumerate() {
        for number in line {
            assert_eq!(number, next);
            assert_eq!(table[number as usize - 1].0, ray.to_string());
            next += 1.0;
        }
    }
    assert_eq!(next as usize - 1, table.len());
}

#[test]
fn edges_of_ply_files_join_points_of_a_ray() {
    let folder = Folder::with_lens();
    let table = positions(&folder);
    folder.succeed(&format!("{BEAM} -o rays.ply"));
    let text = String::from_utf8(folder.read("rays.ply")).unwrap();
    let (header, body) = text.split_once("end_header\n").unwrap();
    let edges = table.len() - 9;
    assert!(header.contains(&format!("element vertex {}\n", table.len())));
    assert!(header.contains(&format!("element edge {edges}\n")));
    let rows: Vec<Vec<f64>> = body.lines().map(numbers).collect();
    assert_eq!(rows.len(), table.len() + edges);
    assert!(
        rows.iter()
            .zip(&table)
            .all(|(row, (_, x))| row[..3] == x[..] && row.len() == 7)
    );
    for edge in &rows[table.len()..] {
        assert_eq!(edge[0] + 1.0, edge[1]);
        for end in &edge[..2] {
            assert_eq!(table[*end as usize].0, edge[2].to_string());
        }
    }
}

#[test]
fn vtk_files_hold_lines_and_lengths() {
    let folder = Folder::with_lens();
    let count = positions(&folder).len();
    folder.succeed(&format!("{BEAM} -o rays.vtk"));
    let text = String::from_utf8(folder.read("rays.vtk")).unwrap();
    assert!(text.starts_with("# vtk DataFile Version 3.0\n"));
    for part in [
        format!("POINTS {count} double"),
        format!("LINES 9 {}", count + 9),
        format!("POINT_DATA {count}"),
    ] {
        assert!(text.contains(&part), "{part}");
    }
    let lines = text.lines().count();
    // Each point has a position, four scalars and a direction; there are 9 lines and 16 headings.
    assert_eq!(lines, 6 * count + 9 + 16);
}

/// Positions, in image pixels, of the curve drawn over the image.
fn overlay(folder: &Folder, ray: &str) -> Vec<[f64; 2]> {
    folder.succeed("render scene.xml --spp 1 -o a.png -q");
    folder.succeed(&format!(
        "trace scene.xml {ray} --overlay a.png -o rays.svg"
    ));
    let text = String::from_utf8(folder.read("rays.svg")).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let lines = document
        .descendants()
        .filter(|n| n.has_tag_name("polyline"));
    let points = lines.flat_map(|line| line.attribute("points").unwrap().split(' '));
    let point = |text: &str| {
        let (x, y) = text.split_once(',').unwrap();
        [x, y].map(|v| v.parse().unwrap())
    };
    points.map(point).collect()
}

/// Pixels per unit of the tangent of the angle to the camera's axis; its field of 40° is 8 pixels
/// wide.
fn pixels_per_tangent() -> f64 {
    4.0 / 20f64.to_radians().tan()
}

/// In empty space the camera at (0, 0, −4) sees straight lines at their true positions; x runs to
/// the left.
#[test]
fn an_overlay_lies_where_the_camera_sees_it() {
    let folder = Folder::with_scene("");
    let ray = "--from=-0.5,0.3,0 --direction 1,0,0 --max-length 1";
    let points = overlay(&folder, ray);
    let (x, y) = (
        0.5 / 4.0 * pixels_per_tangent(),
        0.3 / 4.0 * pixels_per_tangent(),
    );
    let (first, last) = (points[0], points[points.len() - 1]);
    assert!((first[0] - (4.0 + x)).abs() < 0.02, "{first:?}");
    assert!((last[0] - (4.0 - x)).abs() < 0.02, "{last:?}");
    assert!(
        points.iter().all(|p| (p[1] - (3.0 - y)).abs() < 0.01),
        "{points:?}"
    );
    for wrong in [
        "--overlay a.png -o c.csv",
        "--overlay a.png",
        "--overlay scene.xml -o c.svg",
    ] {
        folder.refuse(&format!("trace scene.xml {ray} {wrong}"));
    }
}

/// Glass begins at z = 0. By Snell's law, a point 1 behind its face and 0.8 beside the axis is seen
/// at the angle θ with 4 tan θ + tan θ′ = 0.8, sin θ = 1.5 sin θ′.
#[test]
fn an_overlay_is_refracted() {
    let glass = |screen: &str| {
        Folder::with_scene(&format!(
            r#"<shape type="cube"><transform name="to_world"><scale value="5"/><translate z="5"/></transform>
                 <bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>
               </shape>{screen}"#
        ))
    };
    let ray = "--from=-0.8,0,1 --direction 1,0,0 --max-length 1.6";
    let points = overlay(&glass(""), ray);
    let reach = |tan: f64| {
        let sin = tan / (1.0 + tan * tan).sqrt() / 1.5;
        4.0 * tan + sin / (1.0 - sin * sin).sqrt()
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if reach(middle) < 0.8 {
            low = middle
        } else {
            high = middle
        }
    }
    // The first point is half a piece, of 200, from the start.
    let expected = 4.0 + low * pixels_per_tangent() * (1.0 - 1.0 / 200.0);
    assert!(
        (points[0][0] - expected).abs() < 0.01,
        "{:?}, {expected}",
        points[0]
    );
    // Check that without refraction it would lie elsewhere.
    assert!((expected - (4.0 + 0.8 / 5.0 * pixels_per_tangent())).abs() > 0.05);
    let screen = r#"<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform></shape>"#;
    assert_eq!(overlay(&glass(screen), ray).len(), 0, "a screen hides it");
}

/// Differences are against straight rays in the reference index, in units of length and in waves.
#[test]
fn optical_path_differences_and_waves() {
    let folder = Folder::with_lens();
    let options = "--reference-index 1.25 --wavelength 5e-4";
    for ray in rays(&folder, &format!("{BEAM} {options}")) {
        let points = ray["points"].as_array().unwrap();
        let place = |p: &Value| [0, 1, 2].map(|i| number(&p["x"][i]));
        let start = place(&points[0]);
        for point in points {
            let square = |i: usize| (place(point)[i] - start[i]).powi(2);
            let chord = (square(0) + square(1) + square(2)).sqrt();
            let expected = number(&point["opl"]) - 1.25 * chord;
            let found = number(&point["opd"]);
            assert!(
                (found - expected).abs() < 1e-5,
                "{found} {expected} {point}"
            );
            let waves = number(&point["waves"]);
            assert!((waves * 5e-4 - found).abs() < 1e-15);
        }
    }
    let text = folder.succeed(&format!("{BEAM} {options}"));
    assert!(text.lines().next().unwrap().ends_with(",medium,opd,waves"));
}

/// Differences against the varying index that the scene's `aov` names: here the index of the ball
/// itself, in which rays start and end.
#[test]
fn optical_path_differences_from_a_field() {
    let folder = Folder::with_lens();
    let scene = String::from_utf8(folder.read("scene.xml")).unwrap();
    let aov = r#"<integrator type="aov"><volume name="reference_index" type="luneburg"/></integrator></scene>"#;
    std::fs::write(folder.path("scene.xml"), scene.replace("</scene>", aov)).unwrap();
    let ray = "trace scene.xml --from=-0.5,0.3,0.1 --direction 1,0,0 --max-length 0.8";
    for ray in rays(&folder, ray) {
        let points = ray["points"].as_array().unwrap();
        let (last, before) = points.split_last().unwrap();
        assert!(!before.is_empty() && before.iter().all(|p| p["opd"].is_null()));
        assert!(number(&last["opd"]).abs() < 1e-11, "{last}");
    }
    // A number on the command line takes precedence.
    for ray in rays(&folder, &format!("{ray} --reference-index 1.0")) {
        let last = ray["points"].as_array().unwrap().last().unwrap().clone();
        assert!(number(&last["opd"]) > 0.1, "{last}");
    }
}
