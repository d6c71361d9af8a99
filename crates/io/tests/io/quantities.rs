//! Quantities of sensor rays and second moments: requests of scenes, channels of images, and
//! numbers compared with Mitsuba.

use glam::DVec3;
use morgana_io::image::exr;
use morgana_io::rendered::Picture;
use morgana_io::run::Run;
use morgana_io::{LoadOptions, Loaded, load_scene};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use transport::aov::{Aov, AovTracer};
use transport::path::Workspace;
use transport::render::Rendering;
use transport::sensor::SensorRay;

const BODY: &str = r#"
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm">FILM<rfilter type="box"/><integer name="width" value="4"/><integer name="height" value="3"/></film>
    <sampler type="independent"><integer name="sample_count" value="6"/></sampler>
  </sensor>
  <emitter type="constant"/>
  <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.4, 0.6"/></bsdf></shape>
</scene>"#;
const LUMINANCE: &str = r#"<string name="pixel_format" value="luminance"/>"#;
const SPECTRAL: &str =
    r#"<string name="pixel_format" value="spectral"/><string name="wavelengths" value="500"/>"#;

fn load(integrator: &str, film: &str) -> Result<Loaded, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let body = BODY.replace("FILM", film);
    fs::write(
        &path,
        format!("<scene version=\"3.0.0\">\n{integrator}{body}"),
    )
    .unwrap();
    load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

fn accepted(integrator: &str) -> Loaded {
    load(integrator, "").unwrap_or_else(|e| panic!("{e}"))
}

#[track_caller]
fn refused(integrator: &str, film: &str, expected: &str) {
    let message = load(integrator, film).expect_err("the scene was accepted");
    assert!(
        message.contains(expected),
        "expected {expected:?} in:\n{message}"
    );
}

fn aov(list: &str, nested: &str) -> String {
    format!(r#"<integrator type="aov"><string name="aovs" value="{list}"/>{nested}</integrator>"#)
}

const PATH: &str = r#"<integrator type="path" name="img"/>"#;

fn moment(nested: &str) -> String {
    format!(r#"<integrator type="moment">{nested}</integrator>"#)
}

fn render(loaded: &Loaded) -> Rendering {
    Run::new(loaded).render().unwrap()
}

/// Returns the channels of the image file of a scene, except channels of light and its statistics.
fn channels(loaded: &Loaded) -> BTreeSet<String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    let rendering = render(loaded);
    Picture::new(&rendering, loaded, Vec::new())
        .write_exr(&path)
        .unwrap();
    let image = exr::read(&path).unwrap();
    let names = image.layers.iter().flat_map(|layer| {
        let name = |channel: &String| match layer.name.as_str() {
            "" => channel.clone(),
            layer => format!("{layer}.{channel}"),
        };
        layer.channels.iter().map(move |(channel, _)| name(channel))
    });
    let usual =
        ["", "variance.", "few."].map(|layer| ["R", "G", "B"].map(|c| format!("{layer}{c}")));
    let usual: Vec<String> = usual
        .into_iter()
        .flatten()
        .chain(["samples.N".into()])
        .collect();
    names.filter(|name| !usual.contains(name)).collect()
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Names agree with Mitsuba's `aov_names()`, except for names of the nested image.
#[test]
fn channels_are_named_as_in_mitsuba() {
    let list = "dd.y:depth,nn:sh_normal,al:albedo,p:position,t:uv,g:geo_normal,u:dp_du,v:dp_dv,i:prim_index,s:shape_index";
    let expected = [
        "dd.y.T", "nn.X", "nn.Y", "nn.Z", "al.R", "al.G", "al.B", "p.X", "p.Y", "p.Z", "t.U",
        "t.V", "g.X", "g.Y", "g.Z", "u.X", "u.Y", "u.Z", "v.X", "v.Y", "v.Z", "i.I", "s.I",
    ];
    let mut all = set(&expected);
    all.extend(expected.map(|name| format!("variance.{name}")));
    assert_eq!(channels(&accepted(&aov(list, PATH))), all);
    // Without a nested integrator, the quantities are the image.
    let alone = accepted(&aov(list, ""));
    assert!(!alone.renderer.is_light());
    assert_eq!(
        alone.channel_names.iter().cloned().collect::<BTreeSet<_>>(),
        set(&expected)
    );
}

#[test]
fn own_quantities_have_plain_names_or_others() {
    let expected = |all: &[&str]| {
        let variances = all.iter().map(|name| format!("variance.{name}"));
        set(all)
            .into_iter()
            .chain(variances)
            .collect::<BTreeSet<_>>()
    };
    let loaded = accepted(&aov("deflection, L:optical_length, depth, steps", PATH));
    let all = [
        "valid.V",
        "deflection.X",
        "deflection.Y",
        "L.V",
        "depth.T",
        "steps.V",
    ];
    assert_eq!(channels(&loaded), expected(&all));
    assert_eq!(loaded.channel_names, ["R", "G", "B"]);
    let alone = accepted(&aov("bent:deflection, optical_length, d:depth", ""));
    let all = ["valid", "bent.X", "bent.Y", "optical_length", "d.T"];
    assert_eq!(alone.channel_names, all);
    // Without a list, all quantities of the path are rendered; an empty list gives none.
    let unlisted = accepted(&format!("<integrator type=\"aov\">{PATH}</integrator>"));
    assert_eq!(unlisted.quantity_names.len(), 10);
    assert!(unlisted.quantities.is_some());
    let none = accepted(&aov("", PATH));
    assert!(none.quantities.is_none() && none.quantity_names.is_empty());
}

#[test]
fn second_moments_have_layers() {
    let loaded = accepted(&moment(PATH));
    assert_eq!(
        channels(&loaded),
        set(&["m2_img.R", "m2_img.G", "m2_img.B"])
    );
    let unnamed = accepted(&moment("<integrator type=\"path\"/>"));
    assert_eq!(unnamed.moment.as_deref(), Some("m2"));
    // Integrators may be nested in either order: moments describe the nested content.
    let depth = set(&["d.T", "variance.d.T", "m2_img.R", "m2_img.G", "m2_img.B"]);
    assert_eq!(channels(&accepted(&aov("d:depth", &moment(PATH)))), depth);
    let mut both = depth;
    both.insert("m2_d.T".into());
    assert_eq!(channels(&accepted(&moment(&aov("d:depth", PATH)))), both);
    let alone = channels(&accepted(&moment(&aov("d:depth", ""))));
    assert_eq!(alone, set(&["d.T", "variance.d.T", "m2_d.T"]));
}

/// Second moments of quantities belong to their own channels.
#[test]
fn second_moments_are_of_their_channels() {
    let loaded = accepted(&moment(&aov("steps, p:position, d:depth", PATH)));
    let rendering = render(&loaded);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    Picture::new(&rendering, &loaded, Vec::new())
        .write_exr(&path)
        .unwrap();
    let image = exr::read(&path).unwrap();
    let plane = |layer: &str, channel: &str| {
        image
            .layer(layer)
            .unwrap()
            .channel(channel)
            .unwrap()
            .to_vec()
    };
    for (layer, channel) in [
        ("", "R"),
        ("", "B"),
        ("d", "T"),
        ("p", "X"),
        ("p", "Z"),
        ("steps", "V"),
    ] {
        let mean = plane(layer, channel);
        let (variance, moment) = if layer.is_empty() {
            (plane("variance", channel), plane("m2_img", channel))
        } else {
            let variance = plane(&format!("variance.{layer}"), channel);
            (variance, plane(&format!("m2_{layer}"), channel))
        };
        for i in 0..mean.len() {
            let expected = mean[i] * mean[i] + 5.0 * variance[i];
            assert!(
                (moment[i] - expected).abs() <= 1e-5 * expected,
                "{layer} {channel}"
            );
        }
    }
}

/// `depth` is an `aov` with the quantity of that name alone.
#[test]
fn the_integrator_depth_shows_the_distance() {
    const DEPTH: &str = r#"<integrator type="depth" name="d"/>"#;
    let (depth, listed) = (accepted(DEPTH), accepted(&aov("depth", "")));
    assert_eq!(depth.channel_names, ["depth.T"]);
    assert_eq!(depth.channel_names, listed.channel_names);
    assert_eq!(render(&depth).film, render(&listed).film);
    let by_caller = |integrator: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.xml");
        let body = BODY.replace("FILM", "");
        let text = format!("<scene version=\"3.0.0\">\n{integrator}{body}");
        fs::write(&path, text).unwrap();
        let options = LoadOptions {
            integrator: Some("depth".into()),
            ..LoadOptions::default()
        };
        load_scene(&path, &options).unwrap_or_else(|d| panic!("{d}"))
    };
    for integrator in [PATH, &aov("position", "")] {
        assert_eq!(by_caller(integrator).channel_names, ["depth.T"]);
    }
    let beside = accepted(&aov("p:position, depth", DEPTH));
    let expected = set(&["depth.T", "p.X", "p.Y", "p.Z"]);
    let found = beside.channel_names.iter().cloned();
    assert_eq!(found.collect::<BTreeSet<_>>(), expected);
}

/// The image of the nested integrator is unchanged, bit for bit.
#[test]
fn pictures_stay_as_they_are() {
    let plain = render(&accepted(PATH));
    for holder in [
        aov("d:depth,deflection", PATH),
        moment(PATH),
        moment(&aov("d:depth", PATH)),
    ] {
        let held = render(&accepted(&holder));
        assert_eq!(held.film, plain.film, "{holder}");
        assert_eq!(held.stats, plain.stats, "{holder}");
    }
}

#[test]
fn a_caller_may_name_another_estimator() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let text = format!(
        "<scene version=\"3.0.0\">\n{}{}",
        aov("d:depth", PATH),
        BODY.replace("FILM", "")
    );
    fs::write(&path, text).unwrap();
    let by = |name: &str| {
        let options = LoadOptions {
            integrator: Some(name.into()),
            ..LoadOptions::default()
        };
        load_scene(&path, &options).unwrap()
    };
    assert_eq!(by("bdpt").renderer.name(), "bdpt");
    assert!(by("bdpt").quantities.is_some());
    let alone = by("aov");
    assert!(alone.quantities.is_none());
    assert_eq!(alone.channel_names, ["d.T"]);
}

#[test]
fn mistakes_are_told() {
    for (list, expected) in [
        ("d:depht", "unknown aov 'depht' (did you mean 'depth'?)"),
        (
            "d:duv_dx",
            "'duv_dx' is not known: rays have no differentials with respect to pixels",
        ),
        (":depth", "expected name:type"),
        ("a:depth,b:depth", "'depth' is listed twice"),
        (
            "a:position,a:geo_normal",
            "two quantities have the channel 'a.X'",
        ),
        ("variance.x:depth", "choose another name"),
        ("m2_img:albedo", "choose another name"),
        ("waves", "waves need a 'wavelength'"),
    ] {
        refused(&aov(list, PATH), "", expected);
        refused(&aov(list, ""), "", expected);
    }
    refused(
        &aov("d:depth", &aov("e:depth", PATH)),
        "",
        "'depth' is listed twice",
    );
    refused(&aov("albedo", PATH), SPECTRAL, "the albedo is a colour");
    refused(
        &aov(&format!("{}:depth", "x".repeat(300)), PATH),
        "",
        "a name is longer",
    );
}

/// On films of colours the albedo is red, green and blue. On films of luminance all three are
/// equal, as in Mitsuba's monochromatic variants. Tested alone and beside light.
#[test]
fn albedos_are_colours() {
    for nested in [PATH, ""] {
        for (film, expected) in [("", [0.2, 0.4, 0.6]), (LUMINANCE, [0.371_92; 3])] {
            let loaded = load(&aov("a:albedo", nested), film).unwrap();
            let rendering = render(&loaded);
            let film = rendering
                .quantities
                .as_ref()
                .map_or(&rendering.film, |q| &q.film);
            // The middle of the image is on the ball.
            let found = [0, 1, 2].map(|c| film.mean_at(None, c, 5));
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected as f32).abs() < 1e-4, "{found} {expected}");
            }
        }
    }
}

/// Values of single rays by Mitsuba 3.9.1 (`data/aovs_mitsuba.py`), which computes in single
/// precision.
#[test]
fn first_surfaces_are_those_of_mitsuba() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let loaded = load_scene(&folder.join("aovs_mitsuba.xml"), &LoadOptions::default());
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
    let table = fs::read_to_string(folder.join("aovs_mitsuba.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let of_surfaces = Aov::ALL.into_iter().filter(|aov| aov.is_of_surface());
    let tracer = AovTracer::new(&of_surfaces.collect::<Vec<_>>());
    let mut rays = 0;
    for line in lines {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        let ray = SensorRay {
            origin: DVec3::from_slice(&values[..3]),
            direction: DVec3::from_slice(&values[3..6]).normalize(),
        };
        let mut found = Vec::new();
        let mut ws = Workspace::new(loaded.scene().tolerance());
        tracer.sample(loaded.scene(), ray, &mut ws, &mut found);
        let of = |name: &str| found[tracer.channels().position(|c| c == name).unwrap()];
        let shape = values.last().copied().unwrap();
        for (name, expected) in names.iter().zip(&values).skip(6) {
            // Mitsuba's rectangles and cubes are meshes of triangles.
            if *name == "prim_index.I" && [2.0, 5.0, 11.0, 16.0].contains(&shape) {
                continue;
            }
            let error = (of(name) - expected).abs() / expected.abs().max(1.0);
            assert!(
                error < 2e-5,
                "{name} of shape {shape}: {} instead of {expected}",
                of(name)
            );
        }
        rays += 1;
    }
    assert_eq!(rays, 38);
}
