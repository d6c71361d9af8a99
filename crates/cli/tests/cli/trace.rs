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
    let header = "ray,point,x,y,z,dx,dy,dz,arc_length,opl,index,medium";
    assert_eq!(lines.next(), Some(header));
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    assert!(rows.len() > 50 && rows.iter().all(|r| r.len() == 12));
    assert_eq!(rows.last().unwrap()[0], "8");
    folder.succeed(&format!("{BEAM} -o rays.csv"));
    assert_eq!(folder.read("rays.csv"), text.as_bytes());
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
    // From inside, at 60° to the normal of the upper side: beyond the critical angle of 42°.
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
    // The index as an image and the colour bar's gradient.
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
