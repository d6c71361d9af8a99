//! Textures: bitmaps, checkerboards, and colours of meshes.

use super::support::*;
use glam::DVec3;
use std::fs;
use transport::bsdf::Surface;
use transport::shape::Uv;

#[test]
fn bitmaps_are_decoded_unless_raw() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let load = |text: &str| load_from(directory.path(), "", &textured(text)).unwrap();
    let plain = load(r#"<string name="filter_type" value="nearest"/>"#);
    close(reflectance(bsdf(&plain), [0.2, 0.5]), [0.5, 0.25, 0.0]);
    close(reflectance(bsdf(&plain), [0.7, 0.5]), [0.125, 0.5, 1.0]);
    let raw = load(r#"<boolean name="raw" value="true"/>"#);
    let encoded = PIXELS[0].map(|v| morgana_io::scene::srgb_from_linear(f64::from(v)));
    close(reflectance(bsdf(&raw), [0.25, 0.5]), encoded);
    let wrapped = load(r#"<string name="wrap_mode" value="clamp"/>"#);
    close(reflectance(bsdf(&wrapped), [7.0, 0.5]), [0.125, 0.5, 1.0]);
    let moved = load(
        r#"<transform name="to_uv"><scale value="1, 1, 1"/><translate value="0.5, 0, 0"/></transform>"#,
    );
    close(reflectance(bsdf(&moved), [0.25, 0.5]), [0.125, 0.5, 1.0]);
}

#[test]
fn bitmaps_in_other_channels() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let body = textured(r#"<string name="filter_type" value="nearest"/>"#);
    let luminance = r#"<string name="pixel_format" value="luminance"/>"#;
    let loaded = load_from(directory.path(), luminance, &body).unwrap();
    let y = 0.2126 * 0.5 + 0.7152 * 0.25;
    close(
        reflectance(bsdf(&loaded), [0.2, 0.5]),
        [y; 3].map(|y| y * 1.0),
    );
    let spectral = r#"<string name="pixel_format" value="spectral"/><string name="wavelengths" value="500, 600"/>"#;
    let error = load_from(directory.path(), spectral, &body).unwrap_err();
    assert!(
        error.contains("a coloured bitmap has no meaning on a spectral film"),
        "{error}"
    );
    assert_eq!(error.matches("a coloured bitmap").count(), 1, "{error}");
    write_image(directory.path(), &[[0.25; 3], [0.5; 3]]);
    let loaded = load_from(directory.path(), spectral, &body).unwrap();
    close(reflectance(bsdf(&loaded), [0.2, 0.5]), [0.25, 0.25, 0.25]);
}

#[test]
fn one_bitmap_for_many_shapes_is_read_once() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let body = r#"<texture type="bitmap" id="t"><string name="filename" value="image.png"/></texture>
<shape type="sphere"><bsdf type="diffuse"><ref id="t" name="reflectance"/></bsdf></shape>
<shape type="disk"><bsdf type="diffuse"><ref id="t" name="reflectance"/></bsdf></shape>"#;
    let loaded = load_from(directory.path(), "", body).unwrap();
    let [a, b] = [0, 1].map(|i| reflectance(&loaded.scene().objects()[i].bsdf, [0.3, 0.4]));
    assert_eq!(a, b);
}

#[test]
fn checkerboards_nest() {
    let body = r#"<shape type="rectangle"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<rgb name="color0" value="0.1, 0.2, 0.3"/>
<texture name="color1" type="checkerboard"><float name="color0" value="0.9"/><float name="color1" value="0.8"/>
<transform name="to_uv"><scale value="2, 2, 1"/></transform></texture>
</texture></bsdf></shape>"#;
    let loaded = load(body).unwrap();
    close(reflectance(bsdf(&loaded), [0.1, 0.1]), [0.1, 0.2, 0.3]);
    close(reflectance(bsdf(&loaded), [0.6, 0.1]), [0.9; 3]);
    close(reflectance(bsdf(&loaded), [0.8, 0.1]), [0.8; 3]);
}

#[test]
fn colours_of_vertices() {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("t.ply"), PLY).unwrap();
    let obj = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0.2 0.2 0.2\nf 1 2 3\n";
    fs::write(directory.path().join("t.obj"), obj).unwrap();
    fs::write(
        directory.path().join("plain.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    let body = |kind: &str, name: &str| {
        format!(
            r#"<shape type="{kind}"><string name="filename" value="{name}"/>
<transform name="to_world"><scale value="2"/></transform>
<bsdf type="diffuse"><texture name="reflectance" type="mesh_attribute">
<string name="name" value="vertex_color"/></texture></bsdf></shape>"#
        )
    };
    let grey = morgana_io::scene::linear_from_srgb(128.0 / 255.0);
    for (kind, name, third) in [("ply", "t.ply", grey), ("obj", "t.obj", 0.2)] {
        let loaded = load_from(directory.path(), "", &body(kind, name)).unwrap();
        let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
        s.site.position = DVec3::new(0.5, 1.0, 0.0);
        let value = bsdf(&loaded).eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
        let part = 0.5 * third;
        close(
            [value[0], value[1], value[2]],
            [0.25 + part, 0.25 + part, part],
        );
    }
    let error = load_from(directory.path(), "", &body("obj", "plain.obj")).unwrap_err();
    assert!(error.contains("the shape has no colours"), "{error}");
}

/// Two faces, the first of two triangles, with the attribute names that Mitsuba writes.
#[test]
fn colours_of_faces() {
    let directory = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element face 2\nproperty list uchar int vertex_indices\nproperty float color_0\nproperty float color_1\n\
        property float color_2\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n4 0 1 2 3 0.5 0.25 0.125\n3 1 4 2 0.1 0.2 0.3\n";
    fs::write(directory.path().join("t.ply"), ply).unwrap();
    let body = |name: &str| {
        format!(
            r#"<shape type="ply"><string name="filename" value="t.ply"/><bsdf type="diffuse">
               <texture type="mesh_attribute" name="reflectance"><string name="name" value="{name}"/></texture></bsdf></shape>"#
        )
    };
    let loaded = load_from(directory.path(), "", &body("face_color")).unwrap();
    let first = [0.5, 0.25, 0.125];
    for (triangle, expected) in [(0, first), (1, first), (2, [0.1, 0.2, 0.3])] {
        let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
        s.site.primitive = triangle;
        let value = bsdf(&loaded).eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
        close([value[0], value[1], value[2]], expected);
    }
    let error = load_from(directory.path(), "", &body("vertex_color")).unwrap_err();
    assert!(error.contains("the shape has no colours: "), "{error}");
    let error = load_from(directory.path(), "", &body("face_colour")).unwrap_err();
    assert!(error.contains("did you mean 'face_color'?"), "{error}");
}

/// Images begin at the top; v in .obj files begins at the bottom.
#[test]
fn coordinates_of_obj_files_are_turned() {
    let directory = tempfile::tempdir().unwrap();
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.1 0.2\nvt 0.3 0.4\nvt 0.5 0.6\nf 1/1 2/2 3/3\n";
    fs::write(directory.path().join("t.obj"), obj).unwrap();
    for (flip, expected) in [
        ("", 0.8),
        (r#"<boolean name="flip_tex_coords" value="false"/>"#, 0.2),
    ] {
        let body =
            format!(r#"<shape type="obj"><string name="filename" value="t.obj"/>{flip}</shape>"#);
        let loaded = load_from(directory.path(), "", &body).unwrap();
        let shape = &loaded.scene().objects()[0].shape;
        let sample = shape.sample_area([0.0, 0.0]);
        let uv = sample.uv.get();
        assert!((uv[1] - expected).abs() < 1e-12, "{uv:?}");
    }
}

#[test]
fn roughness_from_images() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &[[0.25; 3], [0.5; 3]]);
    let nearest = r#"<string name="filename" value="image.png"/>
<string name="filter_type" value="nearest"/><boolean name="raw" value="true"/>"#;
    let texture = format!(r#"<texture name="alpha" type="bitmap">{nearest}</texture>"#);
    for kind in ["roughconductor", "roughdielectric", "roughplastic"] {
        let value = |alpha: &str, u: f64| {
            let body = shape(&format!(r#"<bsdf type="{kind}">{alpha}</bsdf>"#));
            let loaded = load_from(directory.path(), "", &body).unwrap_or_else(|e| panic!("{e}"));
            let mut s = Surface::plain(DVec3::Z, 1.0, 1.5);
            s.site.uv = Uv::Plain([u, 0.5]);
            let direction = DVec3::new(0.2, 0.1, 1.0).normalize();
            bsdf(&loaded).eval(&s, DVec3::Z, direction)[0]
        };
        // Expect the numbers in the file, not the values that they encode.
        let stored = [0.25, 0.5].map(morgana_io::scene::srgb_from_linear);
        for (u, alpha) in [(0.2, stored[0]), (0.8, stored[1])] {
            let even = format!(r#"<float name="alpha" value="{alpha}"/>"#);
            let (found, expected) = (value(&texture, u), value(&even, u));
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{kind}: {found}, {expected}"
            );
        }
    }
    refused(
        &shape(r#"<bsdf type="roughplastic"><float name="alpha" value="2"/></bsdf>"#),
        &["'alpha' is 2"],
    );
}

/// A texture times a factor, and a number times a texture.
#[test]
fn multiples_of_textures() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    let image = "<texture type='bitmap'><string name='filename' value='image.png'/>\
                 <string name='filter_type' value='nearest'/></texture>";
    for (factor, expected) in [
        ("<float name='scale' value='0.5'/>", [0.25, 0.125, 0.0]),
        ("<rgb name='scale' value='0.5, 0.8, 1'/>", [0.25, 0.2, 0.0]),
        ("", [0.5, 0.25, 0.0]),
    ] {
        let bsdf_text = |inner: &str| {
            shape(&format!(
                "<bsdf type='diffuse'><texture type='scale' name='reflectance'>{factor}{inner}</texture></bsdf>"
            ))
        };
        let loaded = load_from(directory.path(), "", &bsdf_text(image)).unwrap();
        close(reflectance(bsdf(&loaded), [0.2, 0.5]), expected);
        let plain = "<rgb name='value' value='0.5, 0.25, 0'/>";
        let loaded = load_from(directory.path(), "", &bsdf_text(plain)).unwrap();
        close(reflectance(bsdf(&loaded), [0.2, 0.5]), expected);
    }
    // Double an image that has a pixel of 1.
    let message = load_from(
        directory.path(),
        "",
        &shape(&format!(
            "<bsdf type='diffuse'><texture type='scale' name='reflectance'><float name='scale' value='2'/>{image}</texture></bsdf>"
        )),
    )
    .unwrap_err();
    assert!(message.contains("reflectance"), "{message}");
}

/// A grid of a linear function reproduces it between the centres of its cells, at points of the
/// world.
#[test]
fn volumes_cover_surfaces() {
    let directory = tempfile::tempdir().unwrap();
    let size = [4, 3, 2];
    let value = |x: DVec3| 0.1 + 0.2 * x.x + 0.1 * x.y + 0.3 * x.z;
    let mut samples = Vec::new();
    for k in 0..size[2] {
        for j in 0..size[1] {
            for i in 0..size[0] {
                let index = DVec3::new(i as f64, j as f64, k as f64) + 0.5;
                samples.push(value(index / DVec3::new(4.0, 3.0, 2.0)) as f32);
            }
        }
    }
    let volume = morgana_io::volume::Volume::new(size, 1, samples).unwrap();
    morgana_io::volume::vol::write(&directory.path().join("v.vol"), &volume).unwrap();
    let body = |volume: &str| {
        shape(&format!(
            "<bsdf type='diffuse'><texture type='volume' name='reflectance'>{volume}</texture></bsdf>"
        ))
    };
    let grid = "<volume type='gridvolume' name='volume'><string name='filename' value='v.vol'/>\
                <transform name='to_world'><scale value='2'/><translate x='-1'/></transform></volume>";
    let loaded = load_from(directory.path(), "", &body(grid)).unwrap();
    for x in [DVec3::new(0.3, 0.4, 0.5), DVec3::new(0.8, 0.2, 0.3)] {
        let mut s = Surface::plain(DVec3::Z, 1.0, 1.0);
        s.site.position = x * 2.0 - DVec3::X;
        let found = bsdf(&loaded).eval(&s, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
        close([found[0], found[1], found[2]], [value(x); 3]);
    }
    let constant = "<volume type='constvolume'><rgb name='value' value='0.1, 0.2, 0.3'/></volume>";
    let loaded = load(&body(constant)).unwrap();
    close(reflectance(bsdf(&loaded), [0.0; 2]), [0.1, 0.2, 0.3]);
    refused(&body(""), &["needs a <volume>"]);
    refused(
        "<shape type='rectangle'><emitter type='area'><texture type='volume' name='radiance'>\
         <volume type='gridvolume'><string name='filename' value='v.vol'/></volume></texture></emitter></shape>",
        &["cannot be a volume"],
    );
}

#[test]
fn textures_that_are_not_modelled() {
    for (name, expected) in [
        ("gridtexture", "use a 'bitmap' of one cell"),
        ("wireframe", "use a 'bitmap'"),
        ("curvature", "use a 'mesh_attribute'"),
    ] {
        let text = format!(
            "<bsdf type='diffuse'><texture type='{name}' name='reflectance'><float name='x' value='1'/></texture></bsdf>"
        );
        refused(&shape(&text), &[expected]);
    }
}

/// Face attributes choose between two surfaces; colours may have any name; a scale applies.
#[test]
fn attributes_of_any_name() {
    let directory = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float flow_0\nproperty float flow_1\nproperty float flow_2\n\
        element face 1\nproperty list uchar int vertex_indices\nproperty float weight_0\nend_header\n\
        0 0 0 0.5 0.25 0.1\n1 0 0 0.5 0.25 0.1\n1 1 0 0.5 0.25 0.1\n3 0 1 2 0.25\n";
    fs::write(directory.path().join("t.ply"), ply).unwrap();
    let body = |bsdf: &str| {
        format!("<shape type='ply'><string name='filename' value='t.ply'/>{bsdf}</shape>")
    };
    let attribute = |role: &str, name: &str, scale: f64| {
        format!(
            "<texture type='mesh_attribute' name='{role}'><string name='name' value='{name}'/>\
             <float name='scale' value='{scale}'/></texture>"
        )
    };
    let blend = format!(
        "<bsdf type='blendbsdf'>{}<bsdf type='diffuse'><float name='reflectance' value='0.2'/></bsdf>\
         <bsdf type='diffuse'><float name='reflectance' value='0.6'/></bsdf></bsdf>",
        attribute("weight", "face_weight", 2.0)
    );
    let loaded = load_from(directory.path(), "", &body(&blend)).unwrap();
    close(reflectance(bsdf(&loaded), [0.0; 2]), [0.4; 3]);
    let diffuse = |name: &str| {
        let texture = attribute("reflectance", name, 0.5);
        body(&format!("<bsdf type='diffuse'>{texture}</bsdf>"))
    };
    let loaded = load_from(directory.path(), "", &diffuse("vertex_flow")).unwrap();
    close(reflectance(bsdf(&loaded), [0.0; 2]), [0.25, 0.125, 0.05]);
    for (name, expected) in [
        ("vertex_flaw", "did you mean 'vertex_flow'?"),
        ("heat", "it has vertex_flow, face_weight"),
    ] {
        let error = load_from(directory.path(), "", &diffuse(name)).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

/// Mitsuba's storage format of an image changes nothing except rounding.
#[test]
fn formats_of_bitmaps_are_accepted() {
    let directory = tempfile::tempdir().unwrap();
    write_image(directory.path(), &PIXELS);
    for format in ["auto", "variant", "fp16", "float16", "uint8"] {
        let format = format!("<string name='format' value='{format}'/>");
        let loaded = load_from(directory.path(), "", &textured(&format)).unwrap();
        assert_eq!(loaded.scene().objects().len(), 1);
    }
}

#[test]
fn images_on_meshes_without_texture_coordinates_are_doubtful() {
    let directory = tempfile::tempdir().unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    fs::write(
        directory.path().join("bare.obj"),
        format!("{mesh}f 1 2 3\n"),
    )
    .unwrap();
    let covered = format!("{mesh}vt 0 0\nf 1/1 2/1 3/1\n");
    fs::write(directory.path().join("covered.obj"), covered).unwrap();
    let warnings = |file: &str, texture: &str| {
        let body = format!(
            r#"<shape type="obj" id="leaf"><string name="filename" value="{file}"/>
<bsdf type="twosided"><bsdf type="diffuse">{texture}</bsdf></bsdf></shape>"#
        );
        let loaded = load_from(directory.path(), "", &body).unwrap();
        loaded.warnings.to_string()
    };
    let board = r#"<texture name="reflectance" type="checkerboard"/>"#;
    let text = warnings("bare.obj", board);
    let expected =
        "the mesh of 'leaf' has no texture coordinates: <texture type=\"checkerboard\"> repeats";
    assert!(text.contains(expected), "{text}");
    let plain = r#"<rgb name="reflectance" value="0.1, 0.2, 0.3"/>"#;
    for (file, texture) in [("covered.obj", board), ("bare.obj", plain)] {
        let text = warnings(file, texture);
        assert!(!text.contains("texture coordinates"), "{text}");
    }
}

#[test]
fn coordinates_of_corners_in_ply_files_are_turned_unless_told_otherwise() {
    let directory = tempfile::tempdir().unwrap();
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0.25 1 0.25 0 0.25\n";
    fs::write(directory.path().join("t.ply"), mesh).unwrap();
    let v = |flip: &str| {
        let body =
            format!(r#"<shape type="ply"><string name="filename" value="t.ply"/>{flip}</shape>"#);
        let loaded = load_from(directory.path(), "", &body).unwrap();
        let sample = loaded.scene().objects()[0].shape.sample_area([0.5, 0.5]);
        sample.uv.get()[1]
    };
    assert_eq!(v(""), 0.75);
    assert_eq!(
        v(r#"<boolean name="flip_tex_coords" value="false"/>"#),
        0.25
    );
}

#[test]
fn faces_without_coordinates_beside_others_see_one_corner_of_an_image() {
    let directory = tempfile::tempdir().unwrap();
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nvt 0 0.25\nvt 1 0.25\nf 1/1 2/2 3/1\nf 4 5 6\n";
    fs::write(directory.path().join("t.obj"), mesh).unwrap();
    let body = r#"<shape type="obj"><string name="filename" value="t.obj"/></shape>"#;
    let loaded = load_from(directory.path(), "", body).unwrap();
    let shape = &loaded.scene().objects()[0].shape;
    let [first, second] = [0.25, 0.75].map(|u| shape.sample_area([u, 0.5]).uv.get());
    assert_eq!((first[1], second), (0.75, [0.0, 0.0]));
}
