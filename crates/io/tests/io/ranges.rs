//! Values without a physical meaning are errors that state the range.

use morgana_io::{LoadOptions, load_scene};

/// Returns the messages for a scene of a camera in front of these things.
fn said(content: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let scene = format!(
        r#"<scene version="3.0.0"><sensor type="perspective">
             <transform name="to_world"><lookat origin="0, 0, -4" target="0, 0, 0" up="0, 1, 0"/></transform>
           </sensor><emitter type="constant"/>{content}</scene>"#
    );
    std::fs::write(&path, scene).unwrap();
    match load_scene(&path, &LoadOptions::default()) {
        Ok(_) => String::new(),
        Err(wrong) => wrong.iter().map(|d| format!("{}\n", d.message)).collect(),
    }
}

fn ball(ior: &str) -> String {
    format!(
        r#"<shape type="sphere"><bsdf type="null"/><medium type="transparent" name="interior">{ior}</medium></shape>"#
    )
}

#[test]
fn indices_lie_where_substances_have_them() {
    let range = "at least 0.001 and at most 1000";
    for n in ["1e-30", "1e9", "1e-4", "1001"] {
        let glass = format!(
            r#"<shape type="sphere"><bsdf type="dielectric"><float name="int_ior" value="{n}"/></bsdf></shape>"#
        );
        let constant = ball(&format!(r#"<float name="ior" value="{n}"/>"#));
        let gaussian = ball(&format!(
            r#"<volume name="ior" type="gaussian"><float name="n0" value="{n}"/><float name="delta" value="0"/><float name="width" value="1"/></volume>"#
        ));
        for scene in [glass, constant, gaussian] {
            assert!(said(&scene).contains(range), "{n}: {}", said(&scene));
        }
    }
    for n in ["0.01", "38", "1000"] {
        assert_eq!(
            said(&ball(&format!(r#"<float name="ior" value="{n}"/>"#))),
            ""
        );
    }
}

#[test]
fn fields_keep_to_that_range_within_their_medium() {
    let fisheye = |radius: &str| {
        ball(&format!(
            r#"<volume name="ior" type="fisheye"><float name="radius" value="{radius}"/></volume>"#
        ))
    };
    let wrong = said(&fisheye("1e-9"));
    assert!(
        wrong.contains("the index of medium") && wrong.contains("0.001 to 1000"),
        "{wrong}"
    );
    assert_eq!(said(&fisheye("0.1")), "");
}

#[test]
fn lengths_are_positive() {
    for (name, value) in [("radius", "-1"), ("radius", "0")] {
        let scene =
            format!(r#"<shape type="sphere"><float name="{name}" value="{value}"/></shape>"#);
        assert!(said(&scene).contains("'radius'"), "{}", said(&scene));
    }
}
