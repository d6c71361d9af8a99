//! Scenes in the dialects of Mitsuba 0.5 and 0.6, and of the refractive fork: their translations to
//! Mitsuba 3, written out.

use glam::DVec3;
use morgana_io::scene::SceneHash;
use morgana_io::volume::{Volume, vol};
use morgana_io::{Diagnostics, FileRegistry, LoadOptions, Severity, json, xml};

/// Returns the hash of a scene, and the note on its translation, if there is one.
fn read(text: &str) -> (SceneHash, Option<String>) {
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics}"));
    let note = diagnostics.iter().next().map(|d| {
        assert_eq!(d.severity, Severity::Note, "{diagnostics}");
        assert_eq!(
            d.message,
            "the scene says some things in another form, or for other programs"
        );
        d.help.clone().unwrap_or_default()
    });
    assert!(diagnostics.iter().count() <= 1, "{diagnostics}");
    (scene.hash(&FileRegistry::new()).unwrap(), note)
}

/// Asserts the translation of a scene of version 0.6. Returns the text of the note.
fn becomes(old: &str, new: &str) -> String {
    let (old, note) = read(&format!("<scene version='0.6.0'>{old}</scene>"));
    let (new, none) = read(&format!("<scene version='3.0.0'>{new}</scene>"));
    assert_eq!(none, None);
    assert!(old == new, "not the same scene; {note:?}");
    note.expect("the dialect is another one")
}

/// The errors of a scene of version 0.6.
fn errors(contents: &str) -> Vec<String> {
    let mut diagnostics = Diagnostics::new();
    let text = format!("<scene version='0.6.0'>{contents}</scene>");
    assert!(xml::parse(&text, "scene.xml", &[], &mut diagnostics).is_none());
    let errors = diagnostics.iter().filter(|d| d.severity == Severity::Error);
    errors.map(|d| d.message.clone()).collect()
}

/// JSON scenes and dictionaries accept the XML dialects, with equal notes.
#[test]
fn json_takes_what_xml_takes() {
    let film = |format: &str| {
        (
            format!(
                "<sensor id='s' type='perspective'><film type='hdrfilm'><string name='pixel_format' value='{format}'/></film></sensor>"
            ),
            format!(
                r#""s": {{"type": "perspective", "film": {{"type": "hdrfilm", "pixel_format": "{format}"}}}}"#
            ),
        )
    };
    let plugin = |xml: &str, json: &str| (xml.to_owned(), json.to_owned());
    let scenes = [
        film("rgba"),
        film("luminance_alpha"),
        film("xyz"),
        film("xyza"),
        plugin(
            "<emitter id='e' type='constant'><float name='sampling_weight' value='2'/></emitter>",
            r#""e": {"type": "constant", "sampling_weight": 2.0}"#,
        ),
        plugin(
            "<integrator id='i' type='volpath_simple'><boolean name='strict_normals' value='true'/></integrator>",
            r#""i": {"type": "volpath_simple", "strict_normals": true}"#,
        ),
        plugin(
            "<sensor id='s' type='perspective'><film type='ldrfilm'><boolean name='banner' value='false'/></film></sensor>",
            r#""s": {"type": "perspective", "film": {"type": "ldrfilm", "banner": false}}"#,
        ),
        plugin(
            "<bsdf id='b' type='hdielectric'/>",
            r#""b": {"type": "hdielectric"}"#,
        ),
    ];
    for (xml, text) in scenes {
        let (hash, note) = read(&format!("<scene version='3.0.0'>{xml}</scene>"));
        let mut diagnostics = Diagnostics::new();
        let text = format!(r#"{{"type": "scene", {text}}}"#);
        let scene = json::parse(&text, "scene.json", &[], &mut diagnostics);
        let scene = scene.unwrap_or_else(|| panic!("{text}: {diagnostics}"));
        assert!(scene.hash(&FileRegistry::new()).unwrap() == hash, "{text}");
        let notes: Vec<_> = diagnostics.iter().collect();
        assert_eq!(notes.len(), 1, "{text}: {diagnostics}");
        assert_eq!(notes[0].severity, Severity::Note, "{text}");
        assert_eq!(notes[0].help, note, "{text}");
    }
}

/// Shapes around media scatter no light unless they have a bsdf.
#[test]
fn boundaries_of_media_without_a_bsdf_are_null() {
    let medium = "<medium type='homogeneous' id='smoke'/>";
    let shape = |bsdf: &str| {
        format!("{medium}<shape type='sphere'><ref name='interior' id='smoke'/>{bsdf}</shape>")
    };
    let null = "<bsdf type='null'/>";
    let said = "read: boundaries of media without a bsdf as 'null'";
    assert_eq!(becomes(&shape(""), &shape(null)), said);
    for bsdf in [null, "<bsdf type='diffuse'/>", "<emitter type='area'/>"] {
        assert_eq!(becomes(&shape(bsdf), &shape(bsdf)), "", "{bsdf}");
    }
    let plain = "<shape type='sphere'/>";
    assert_eq!(becomes(plain, plain), "");
}

#[test]
fn how_media_are_marched_through_is_ignored() {
    let medium = |more: &str| format!("<medium type='heterogeneous'>{more}</medium>");
    let steps = "<float name='stepSize' value='0.1'/><string name='method' value='simpson'/>";
    let note = becomes(&medium(steps), &medium(""));
    assert_eq!(
        note,
        "ignored: 'method' of 'heterogeneous', 'step_size' of 'heterogeneous'"
    );
}

#[test]
fn names_of_parameters_and_roles() {
    let note = becomes(
        "<default name='sampleCount' value='4'/>
         <sensor type='perspective'>
           <transform name='toWorld'><lookAt origin='0,0,5' target='0,0,0' up='0,1,0'/></transform>
           <float name='fov' value='30'/> <string name='fovAxis' value='y'/>
           <float name='shutterOpen' value='0'/>
           <sampler type='independent'><integer name='sampleCount' value='$sampleCount'/></sampler>
           <film type='hdrfilm'><integer name='width' value='4'/><boolean name='banner' value='false'/></film>
         </sensor>
         <bsdf type='dielectric' id='glass'><float name='intIOR' value='1.5'/><float name='extIOR' value='1'/></bsdf>",
        "<default name='sampleCount' value='4'/>
         <sensor type='perspective'>
           <transform name='to_world'><lookat origin='0,0,5' target='0,0,0' up='0,1,0'/></transform>
           <float name='fov' value='30'/> <string name='fov_axis' value='y'/>
           <sampler type='independent'><integer name='sample_count' value='$sampleCount'/></sampler>
           <film type='hdrfilm'><integer name='width' value='4'/></film>
         </sensor>
         <bsdf type='dielectric' id='glass'><float name='int_ior' value='1.5'/><float name='ext_ior' value='1'/></bsdf>",
    );
    assert_eq!(
        note,
        "ignored: 'banner' of 'hdrfilm', 'shutter_open' of 'perspective'"
    );
}

/// Films of earlier versions of the fork, and unmodulated films.
#[test]
fn earlier_films_of_the_fork() {
    let camera = |film: &str| {
        format!("<sensor type='perspective'><film type='hdrfilm'>{film}</film></sensor>")
    };
    let binned = camera(
        "<string name='decomposition' value='transient'/><float name='min_bound' value='150'/>
         <float name='max_bound' value='250'/><float name='bin_width' value='2'/>",
    );
    let bounds = "<float name='pathMin' value='150'/><float name='pathMax' value='250'/><float name='pathSample' value='2'/>";
    let transient = |is: bool| format!("<boolean name='transient' value='{is}'/>{bounds}");
    becomes(&camera(&transient(true)), &binned);
    becomes(&camera(&transient(false)), &camera(""));
    let modulated = |word: &str| {
        camera(&format!(
            "<string name='modulation' value='{word}'/><float name='lambda' value='3'/><float name='phase' value='0'/>"
        ))
    };
    becomes(&modulated("none"), &camera(""));
    let mut diagnostics = Diagnostics::new();
    let text = format!("<scene version='0.6.0'>{}</scene>", modulated("square"));
    let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics).unwrap();
    let refused = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics).unwrap_err();
    assert!(
        refused.to_string().contains("no parameter 'modulation'"),
        "{refused}"
    );
}

#[test]
fn older_bsdfs() {
    let note = becomes(
        "<bsdf type='roughdiffuse' id='a'><spectrum name='diffuseReflectance' value='0.4'/><boolean name='useFastApprox' value='true'/></bsdf>
         <bsdf type='ward' id='b'><string name='variant' value='ward-duer'/><float name='alphaU' value='0.1'/><float name='alphaV' value='0.2'/></bsdf>
         <bsdf type='roughconductor' id='c'><string name='distribution' value='as'/><string name='material' value='Au'/></bsdf>
         <bsdf type='coating' id='d'><float name='intIOR' value='1.7'/><spectrum name='sigmaA' value='0.1'/><bsdf type='diffuse'/></bsdf>",
        "<bsdf type='roughdiffuse' id='a'><float name='reflectance' value='0.4'/><boolean name='use_fast_approx' value='true'/></bsdf>
         <bsdf type='ward' id='b'><float name='alpha_u' value='0.1'/><float name='alpha_v' value='0.2'/></bsdf>
         <bsdf type='roughconductor' id='c'><string name='distribution' value='beckmann'/><string name='material' value='Au'/></bsdf>
         <bsdf type='coating' id='d'><float name='int_ior' value='1.7'/><float name='sigma_a' value='0.1'/><bsdf type='diffuse'/></bsdf>",
    );
    assert_eq!(
        note,
        "read: facets 'as' as 'beckmann'; ignored: 'variant' of 'ward'"
    );
}

/// Scenes of version 0.6 with a sky: direction of the sun by Mitsuba's documentation (y up, −z to
/// the north, in the afternoon in the west, −x), and the light of each plugin.
#[test]
fn older_skies() {
    use transport::emitter::{Emitter, Environment};
    let load = |emitter: &str| {
        let text = format!(
            "<scene version='0.6.0'><sensor type='perspective'><film type='hdrfilm'/></sensor>{emitter}</scene>"
        );
        let mut diagnostics = Diagnostics::new();
        let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics);
        let scene = scene.unwrap_or_else(|| panic!("{diagnostics}"));
        morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics).unwrap()
    };
    let parts = |emitter: &str| {
        let loaded = load(emitter);
        let emitters = loaded.groups[0].emitters();
        emitters.iter().map(Emitter::kind).collect::<Vec<_>>()
    };
    assert_eq!(parts("<emitter type='sky'/>"), ["envmap"]);
    assert_eq!(parts("<emitter type='sun'/>"), ["disc"]);
    assert_eq!(parts("<emitter type='sunsky'/>"), ["envmap", "disc"]);
    // Mean of random directions towards the sun.
    let toward = |emitter: &str| {
        let loaded = load(emitter);
        let Emitter::Environment(Environment::Disc(disc)) = &loaded.groups[0].emitters()[0] else {
            panic!("no disc");
        };
        Environment::Disc(*disc).sample([0.0, 0.0]).0
    };
    let afternoon = toward("<emitter type='sun'/>");
    assert!(afternoon.y > 0.7 && afternoon.x < -0.5, "{afternoon}");
    let given = "<emitter type='sun'><vector name='sunDirection' x='0.48' y='0.6' z='0.64'/><float name='sunRadiusScale' value='0'/></emitter>";
    assert!(toward(given).distance(DVec3::new(0.48, 0.6, 0.64)) < 1e-9);
}

#[test]
fn animations_stay_at_their_first_transform() {
    let shape = |transform: &str| format!("<shape type='sphere' id='s'>{transform}</shape>");
    let animated = shape(
        "<animation name='toWorld'><transform time='0'><translate x='1'/></transform><transform time='1'><translate x='2'/></transform></animation>",
    );
    let mut diagnostics = Diagnostics::new();
    let text = format!("<scene version='0.6.0'>{animated}</scene>");
    let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics).unwrap();
    assert!(diagnostics.to_string().contains("uses the first transform"));
    let (still, _) = read(&format!(
        "<scene version='0.6.0'>{}</scene>",
        shape("<transform name='toWorld'><translate x='1'/></transform>")
    ));
    assert!(scene.hash(&FileRegistry::new()).unwrap() == still);
    for (contents, expected) in [
        ("<animation name='toWorld'/>", "no <transform>"),
        (
            "<animation name='toWorld'><float name='x' value='1'/></animation>",
            "made of <transform>",
        ),
    ] {
        assert!(
            errors(&shape(contents))
                .iter()
                .any(|e| e.contains(expected))
        );
    }
}

#[test]
fn diffuse_transmitters() {
    let note = becomes(
        "<bsdf type='difftrans' id='leaf'><spectrum name='transmittance' value='0.4'/></bsdf>",
        "<bsdf type='principledthin' id='leaf'><float name='base_color' value='0.4'/>
         <float name='diff_trans' value='2'/></bsdf>",
    );
    assert_eq!(note, "read: 'difftrans' as 'principledthin'");
}

#[test]
fn the_medium_of_the_fork() {
    let note = becomes(
        "<medium type='heterogeneousrefractive' id='tissue'>
           <spectrum name='sigmaT' value='1.5'/> <spectrum name='albedo' value='0.9'/>
           <float name='stepsize' value='1e-3'/> <float name='tol2' value='1e-6'/>
           <volume name='rif' type='acousticrifvolume'>
             <float name='n_max' value='1e-3'/> <integer name='mode' value='2'/>
             <point name='min' x='-1' y='-1' z='-1'/> <point name='max' x='1' y='1' z='1'/>
           </volume>
           <volume name='sdf' type='splinevolume'><string name='filename' value='sdf.vol'/></volume>
           <phase type='hg'><float name='g' value='0.85'/></phase>
         </medium>
         <bsdf type='hdielectric' id='wall'/>",
        "<medium type='homogeneous' id='tissue'>
           <float name='sigma_t' value='1.5'/> <float name='albedo' value='0.9'/>
           <volume name='ior' type='acoustic'>
             <float name='amplitude' value='1e-3'/> <integer name='order' value='2'/>
             <float name='frequency' value='832000'/> <float name='sound_speed' value='1500'/>
             <float name='n0' value='1.3333'/>
             <vector name='direction' value='1, 0, 0'/> <vector name='reference' value='0, 0, 1'/>
           </volume>
           <phase type='hg'><float name='g' value='0.85'/></phase>
         </medium>
         <bsdf type='dielectric' id='wall'/>",
    );
    assert_eq!(
        note,
        "read: 'acousticrifvolume' as 'acoustic', 'splinevolume' as 'bspline', 'heterogeneousrefractive' as \
         'homogeneous', 'hdielectric' as 'dielectric'; ignored: 'min' of 'acousticrifvolume', 'max' of \
         'acousticrifvolume', 'sdf' of 'heterogeneousrefractive', 'stepsize' of 'heterogeneousrefractive', 'tol2' of \
         'heterogeneousrefractive'"
    );
    let material =
        "<medium type='heterogeneousrefractive'><string name='material' value='skin1'/></medium>";
    assert_eq!(
        errors(material),
        [
            "'heterogeneousrefractive' takes its coefficients from a material, which scenes of older versions cannot name here"
        ]
    );
    let error = errors(&material.replace("heterogeneousrefractive", "homogeneous"));
    assert!(error[0].starts_with("'homogeneous' takes its coefficients from a material"));
}

#[test]
fn grids_lie_in_the_box_of_their_file_or_in_their_own() {
    becomes(
        "<volume type='splinevolume' id='n'><string name='filename' value='n.vol'/></volume>
         <volume type='gridvolume' id='s'><string name='filename' value='s.vol'/></volume>",
        "<volume type='bspline' id='n'><string name='filename' value='n.vol'/>
           <string name='placement' value='nodes'/><boolean name='use_grid_bbox' value='true'/></volume>
         <volume type='gridvolume' id='s'><string name='filename' value='s.vol'/>
           <string name='placement' value='nodes'/><boolean name='use_grid_bbox' value='true'/></volume>",
    );
    // The box is applied before the transform.
    becomes(
        "<volume type='splinevolume' id='n'><string name='filename' value='n.vol'/>
           <point name='min' value='-1, -2, -3'/><point name='max' value='1, 2, 3'/>
           <transform name='toWorld'><scale value='2'/></transform></volume>",
        "<volume type='bspline' id='n'><string name='filename' value='n.vol'/>
           <string name='placement' value='nodes'/><boolean name='use_grid_bbox' value='false'/>
           <transform name='to_world'><scale value='2, 4, 6'/><translate value='-1, -2, -3'/>
             <scale value='2'/></transform></volume>",
    );
    let empty = "<volume type='splinevolume'><string name='filename' value='n.vol'/>
           <point name='min' value='0'/><point name='max' value='0'/></volume>";
    let expected = "'max' must be greater than 'min' in every coordinate";
    assert_eq!(errors(empty), [expected]);
}

#[test]
fn films_of_the_fork() {
    becomes(
        "<sensor type='orthographic'><film type='mfilm'>
           <string name='decomposition' value='transient'/>
           <float name='minBound' value='2'/><float name='maxBound' value='8'/></film></sensor>",
        "<sensor type='orthographic'><film type='hdrfilm'>
           <string name='decomposition' value='transient'/><float name='bin_width' value='1'/>
           <float name='min_bound' value='2'/><float name='max_bound' value='8'/>
           <integer name='width' value='1'/><integer name='height' value='1'/></film></sensor>",
    );
    becomes(
        "<sensor type='orthographic'><film type='ldrfilm'>
           <string name='decomposition' value='bounce'/><float name='maxBound' value='8'/></film></sensor>",
        "<sensor type='orthographic'><film type='hdrfilm'>
           <string name='decomposition' value='bounce'/><integer name='max_bounces' value='7'/></film></sensor>",
    );
    becomes(
        "<film type='hdrfilm'><string name='decomposition' value='none'/><float name='maxBound' value='8'/></film>",
        "<film type='hdrfilm'/>",
    );
    let some = "<film type='hdrfilm'><string name='decomposition' value='bounce'/>
        <float name='minBound' value='2'/><float name='maxBound' value='8'/></film>";
    let expected =
        "bounces are separated one by one, from none: 'minBound' must be 0, 'binWidth' 1";
    assert_eq!(errors(some), [expected]);
}

/// Parameters of Mitsuba's own scene files that have no meaning in morgana are ignored in scenes of
/// any version.
#[test]
fn weights_of_emitters_and_opacity_are_ignored() {
    let (with, note) = read(
        "<scene version='3.0.0'><sensor type='orthographic'><film type='hdrfilm'>
           <string name='pixel_format' value='rgba'/></film></sensor>
         <emitter type='constant'><float name='sampling_weight' value='2'/></emitter></scene>",
    );
    let (without, none) = read(
        "<scene version='3.0.0'><sensor type='orthographic'><film type='hdrfilm'>
           <string name='pixel_format' value='rgb'/></film></sensor>
         <emitter type='constant'/></scene>",
    );
    assert!(with == without);
    assert_eq!(none, None);
    let expected = "ignored: 'alpha' of 'hdrfilm', 'sampling_weight' of 'constant'";
    assert_eq!(note.as_deref(), Some(expected));
}

#[test]
fn films_of_tristimulus_values_are_colours() {
    let film = |format: &str| {
        format!("<film type='hdrfilm' id='f'><string name='pixel_format' value='{format}'/></film>")
    };
    let note = becomes(&film("xyz"), &film("rgb"));
    assert_eq!(note, "read: pixel_format 'xyz' as 'rgb'");
    let note = becomes(&film("XYZA"), &film("rgb"));
    assert_eq!(
        note,
        "read: pixel_format 'XYZA' as 'rgb'; ignored: 'alpha' of 'hdrfilm'"
    );
}

/// A spline through samples of a linear index reproduces it, at the nodes of the file's box or of a
/// given box.
#[test]
fn an_index_of_the_fork_is_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let size = [5, 4, 6];
    let (min, max) = (DVec3::new(-1.0, -2.0, -1.5), DVec3::new(1.0, 1.0, 2.0));
    let n = |x: DVec3| 1.3 + 0.01 * x.x - 0.02 * x.y + 0.005 * x.z;
    let mut samples = Vec::new();
    for k in 0..size[2] {
        for j in 0..size[1] {
            for i in 0..size[0] {
                let u = DVec3::new(i as f64 / 4.0, j as f64 / 3.0, k as f64 / 5.0);
                samples.push(n(min + (max - min) * u) as f32);
            }
        }
    }
    let volume = Volume::new(size, 1, samples).unwrap().with_bbox([min, max]);
    vol::write(&folder.path().join("n.vol"), &volume).unwrap();
    let index = |own: &str| {
        let text = format!(
            "<scene version='0.6.0'><sensor type='perspective'><float name='fov' value='20'/>
               <transform name='toWorld'><lookAt origin='0,0,9' target='0,0,0' up='0,1,0'/></transform></sensor>
             <shape type='sphere'><float name='radius' value='0.3'/><bsdf type='null'/>
               <medium name='interior' type='heterogeneousrefractive'>
                 <spectrum name='sigmaS' value='1'/><spectrum name='sigmaA' value='0'/>
                 <volume name='rif' type='splinevolume'><string name='filename' value='n.vol'/>{own}</volume>
               </medium></shape><emitter type='constant'/></scene>"
        );
        let path = folder.path().join("scene.xml");
        std::fs::write(&path, text).unwrap();
        let loaded = morgana_io::load_scene(&path, &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
        let field = loaded.scene().medium(1).index.clone();
        move |x: DVec3| field.n(x)
    };
    for x in [DVec3::ZERO, DVec3::new(0.11, -0.07, 0.19)] {
        assert!((index("")(x) - n(x)).abs() < 1e-6);
        let half =
            "<point name='min' value='-0.5, -1, -0.75'/><point name='max' value='0.5, 0.5, 1'/>";
        assert!((index(half)(x) - n(2.0 * x)).abs() < 1e-6);
        let moved = "<transform name='toWorld'><scale value='2'/><translate x='0.1'/></transform>";
        let before = (x - DVec3::X * 0.1) / 2.0;
        assert!((index(moved)(x) - n(before)).abs() < 1e-6);
    }
}

/// Loads a scene of version 0.6 with a camera.
fn load(contents: &str) -> Result<morgana_io::Loaded, Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    let text = format!(
        "<scene version='0.6.0'><sensor type='perspective'/><emitter type='constant'/>{contents}</scene>"
    );
    let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics);
    match scene {
        Some(scene) => morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics),
        None => Err(diagnostics),
    }
}

/// Colours encoded in sRGB, by hand: 0x88/255 = 0.5333 is 0.2462 linear (IEC 61966-2-1), 0.5 is
/// 0.2140.
#[test]
fn encoded_colours_become_linear() {
    for (value, expected) in [
        ("#ff8800", [1.0, 0.246_201, 0.0]),
        ("0.5, 1, 0", [0.214_041, 1.0, 0.0]),
        ("0.5", [0.214_041; 3]),
    ] {
        let loaded = load(&format!(
            "<shape type='sphere'><transform name='toWorld'><translate z='9'/></transform><bsdf type='diffuse'>
             <srgb name='reflectance' value='{value}'/></bsdf></shape>"
        ))
        .unwrap_or_else(|e| panic!("{e}"));
        let surface = transport::bsdf::Surface::plain(DVec3::Z, 1.0, 1.0);
        let bsdf = &loaded.scene().objects()[0].bsdf;
        let found = bsdf.eval(&surface, DVec3::Z, DVec3::Z) * std::f64::consts::PI;
        for (c, expected) in expected.into_iter().enumerate() {
            assert!((found[c] - expected).abs() < 1e-6, "{value}: {found:?}");
        }
    }
    let wrong = "<bsdf type='diffuse'><srgb name='reflectance' value='#ff88'/></bsdf>";
    assert_eq!(errors(wrong), ["'#ff88' is not a colour like #ff8800"]);
}

#[test]
fn thermal_radiation_is_a_spectrum_plugin() {
    let scene = |spectrum: &str| format!("<emitter type='constant' id='c'>{spectrum}</emitter>");
    let plugin = |scale: &str| {
        let temperature = "<float name='temperature' value='5000'/>";
        scene(&format!(
            "<spectrum type='blackbody' name='radiance'>{temperature}{scale}</spectrum>"
        ))
    };
    let plain = scene("<blackbody name='radiance' temperature='5000K'/>");
    becomes(&plain, &plugin(""));
    becomes(
        &scene("<blackbody name='radiance' temperature='5000' scale='0.25'/>"),
        &plugin("<float name='scale' value='0.25'/>"),
    );
    for temperature in ["hot", "-5K", "0", "1e999"] {
        let found = errors(&plain.replace("5000K", temperature));
        let expected = format!(
            "expected a temperature in kelvin such as 5000K, greater than 0, found '{temperature}'"
        );
        assert_eq!(found, [expected]);
    }
    let nameless = errors("<emitter type='constant'><blackbody temperature='5000'/></emitter>");
    assert_eq!(nameless, ["<blackbody> needs the attribute 'name'"]);
}

#[test]
fn metals_are_copper_unless_they_say_otherwise() {
    let metal = |what: &str| format!("<bsdf type='conductor' id='m'>{what}</bsdf>");
    let copper = "<string name='material' value='Cu'/>";
    becomes(&metal(""), &metal(copper));
    let numbers = |tag: &str| format!("<{tag} name='eta' value='1'/><{tag} name='k' value='2'/>");
    becomes(
        &metal(&format!("{copper}{}", numbers("spectrum"))),
        &metal(&numbers("float")),
    );
}

#[test]
fn integrators_that_are_rendered_by_others() {
    let integrator =
        |name: &str, what: &str| format!("<integrator type='{name}'>{what}</integrator>");
    let depths = |max: &str, rr: &str| {
        format!("<integer name='{max}' value='7'/><integer name='{rr}' value='9'/>")
    };
    for (old, new, own) in [
        ("photonmapper", "photon", "globalPhotons"),
        ("ppm", "photon", "photonCount"),
        ("pssmlt", "bdpt", "luminanceSamples"),
        ("mlt", "bdpt", "directSamples"),
        ("erpt", "bdpt", "chainLength"),
        ("vpl", "path", "shadowMapResolution"),
        ("sppm", "sppm", "maxPasses"),
    ] {
        let own_parameter = format!("<integer name='{own}' value='5'/>");
        let written = format!("{}{own_parameter}", depths("maxDepth", "rrDepth"));
        let note = becomes(
            &integrator(old, &written),
            &integrator(new, &depths("max_depth", "rr_depth")),
        );
        let read = format!("read: '{old}' as '{new}'");
        assert_eq!(note.contains(&read), old != new, "{note}");
        let words = note.split("ignored: '").nth(1).unwrap_or_default();
        assert!(words.ends_with(&format!("of '{old}'")), "{note}");
    }
    let path = integrator("path", &depths("maxDepth", "rrDepth"));
    for frame in ["irrcache", "adaptive", "multichannel"] {
        let inner = format!("<boolean name='verbose' value='true'/>{path}");
        let note = becomes(
            &integrator(frame, &inner),
            &integrator("path", &depths("max_depth", "rr_depth")),
        );
        let expected =
            format!("read: '{frame}' as the integrator in it; ignored: 'verbose' of '{frame}'");
        assert_eq!(note, expected);
    }
    let occlusion = errors(&integrator("ao", ""));
    let expected = "ambient occlusion is not rendered by an integrator of its own";
    assert_eq!(occlusion, [expected]);
}

#[test]
fn images_of_older_textures() {
    let image = |what: &str| {
        format!(
            "<texture type='bitmap' id='t'><string name='filename' value='a.png'/>{what}</texture>"
        )
    };
    becomes(
        &image(
            "<string name='filterType' value='trilinear'/><string name='wrapModeU' value='clamp'/>
             <string name='wrapModeV' value='clamp'/><float name='gamma' value='1'/>
             <float name='uvscale' value='2'/><float name='vscale' value='3'/><float name='uoffset' value='0.5'/>",
        ),
        &image(
            "<string name='filter_type' value='bilinear'/><string name='wrap_mode' value='clamp'/>
             <boolean name='raw' value='true'/>
             <transform name='to_uv'><scale x='2' y='3' z='1'/><translate x='0.5'/></transform>",
        ),
    );
    let note = becomes(&image("<float name='gamma' value='2.2'/>"), &image(""));
    assert_eq!(note, "ignored: 'gamma' of 'bitmap'");
    let colours = "<texture type='vertexcolors' id='t'/>";
    let attribute = "<texture type='mesh_attribute' id='t'><string name='name' value='vertex_color'/></texture>";
    assert_eq!(
        becomes(colours, attribute),
        "read: 'vertexcolors' as 'mesh_attribute'"
    );
}

/// Names of Mitsuba 0.6 are unknown in scenes of version 3, and vice versa.
#[test]
fn a_scene_has_one_dialect() {
    let mut diagnostics = Diagnostics::new();
    let text = "<scene version='3.0.0'><sensor type='orthographic'>
        <transform name='toWorld'/></sensor></scene>";
    let scene = xml::parse(text, "scene.xml", &[], &mut diagnostics).unwrap();
    let refused = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics).unwrap_err();
    let text = refused.to_string();
    assert!(text.contains("no parameter 'toWorld'"), "{text}");
    assert!(text.contains("did you mean 'to_world'?"), "{text}");
}
