//! Films of scene files that separate light: accepted and refused parameters.

use morgana_io::{LoadOptions, Loaded, Run};
use std::fs;
use transport::Bins;
use transport::film::Decomposition;

/// A scene whose film has these parameters, from line 3.
fn load(film: &str) -> Result<Loaded, String> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="40"/>
<film type="hdrfilm">
{film}
</film></sensor>
<emitter type="point" id="light"><float name="intensity" value="1"/><point name="position" y="2"/></emitter>
<emitter type="constant"/>
<shape type="sphere" id="bulb"><point name="center" y="9"/><emitter type="area"><float name="radiance" value="1"/></emitter></shape>
<shape type="sphere"><point name="center" y="7"/><emitter type="area" id="v1.2"><float name="radiance" value="1"/></emitter></shape>
<emitter type="point"><float name="intensity" value="1"/><point name="position" y="3"/></emitter>
<emitter type="point"><float name="intensity" value="1"/><point name="position" y="4"/></emitter>
</scene>"#
    );
    fs::write(&path, text).unwrap();
    morgana_io::load_scene(&path, &LoadOptions::default()).map_err(|d| d.to_string())
}

#[track_caller]
fn decomposition(film: &str) -> Decomposition {
    load(film)
        .unwrap_or_else(|e| panic!("{e}"))
        .layering
        .decomposition
}

#[track_caller]
fn refused(film: &str, expected: &[&str]) {
    let message = load(film).expect_err("the film was accepted");
    for part in expected {
        assert!(message.contains(part), "expected {part:?} in:\n{message}");
    }
}

fn by(words: &str) -> String {
    format!("<string name=\"decomposition\" value=\"{words}\"/>\n")
}

fn bounds(min: &str, max: &str, width: &str) -> String {
    [("min_bound", min), ("max_bound", max), ("bin_width", width)]
        .map(|(name, value)| format!("<float name=\"{name}\" value=\"{value}\"/>\n"))
        .concat()
}

#[test]
fn films_tell_light_apart() {
    assert_eq!(decomposition(""), Decomposition::default());
    let bins = Bins {
        min: 1.0,
        max: 4.0,
        count: 6,
    };
    for word in ["length", "transient"] {
        let film = by(word) + &bounds("1", "4", "0.5");
        assert_eq!(decomposition(&film).length, Some(bins));
    }
    let film = by("time, light,bounce") + &bounds("1", "4", "0.5");
    let film = film + "<float name=\"speed_of_light\" value=\"2\"/>";
    let all = decomposition(&(film + "<integer name=\"max_bounces\" value=\"3\"/>"));
    let bins = Bins {
        min: 2.0,
        max: 8.0,
        count: 6,
    };
    assert_eq!(all.length, Some(bins));
    assert_eq!((all.bounces, all.emitters), (Some(3), Some(6)));
}

#[test]
fn a_film_without_lights_has_none_to_tell_apart() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("scene.xml");
    let film = by("light");
    let text = format!(
        r#"<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm">
{film}<integer name="width" value="2"/><integer name="height" value="2"/></film>
<sampler type="independent"><integer name="sample_count" value="1"/></sampler></sensor></scene>"#
    );
    fs::write(&path, text).unwrap();
    let loaded = morgana_io::load_scene(&path, &LoadOptions::default()).unwrap();
    assert_eq!(loaded.layering.decomposition, Decomposition::default());
    assert_eq!(Run::new(&loaded).render().unwrap().film.summary().0, 0.0);
}

/// A tenth has no finite binary expansion; thirty of them still fill 3.
#[test]
fn decimal_widths_divide() {
    let film = by("length") + &bounds("0", "3", "0.1");
    assert_eq!(decomposition(&film).length.unwrap().count, 30);
}

#[test]
fn emitters_have_names_of_their_own() {
    let names = load("").unwrap().emitter_names;
    let expected = ["bulb", "v1_2", "light", "constant", "point", "point_2"];
    assert_eq!(names, expected);
}

#[test]
fn mistakes_have_places_and_help() {
    refused(
        &by("lenght"),
        &["scene.xml:3:", "'lenght'", "did you mean 'length'?"],
    );
    refused(
        &by("colour"),
        &["it is a list of: length, time, bounce, light"],
    );
    refused(&by("light, light"), &["'light' is there twice"]);
    refused(
        &(by("length, time") + &bounds("0", "1", "0.5")),
        &[
            "give length or time, not both",
            "needs <float name=\"speed_of_light\">",
        ],
    );
    refused(
        &by("length"),
        &[
            "needs <float name=\"max_bound\">",
            "needs <float name=\"bin_width\">",
        ],
    );
    refused(&by("bounce"), &["needs <integer name=\"max_bounces\">"]);
    refused(
        &(by("length") + &bounds("2", "2", "0.5")),
        &[
            "scene.xml:5:",
            "'max_bound' is 2 but must be greater than 'min_bound', 2",
        ],
    );
    refused(
        &(by("length") + &bounds("0", "1", "0.3")),
        &[
            "scene.xml:6:",
            "bins of 0.3 do not fill the range from 0 to 1",
            "3 of 0.333",
        ],
    );
    refused(
        &(by("length") + &bounds("0", "1", "3")),
        &["bins of 3 do not fill", "1 of 1 would"],
    );
    refused(
        &(by("length") + &bounds("0", "1", "-1")),
        &["'bin_width' is -1"],
    );
    refused(
        &(by("length") + &bounds("0", "1", "1e-9")),
        &["at most 65536"],
    );
    refused(
        &(by("length") + &bounds("0", "1", "0.5").replace("bin_width", "binWidth")),
        &["did you mean 'bin_width'?"],
    );
}

#[test]
fn parameters_without_effect_draw_a_warning() {
    let loaded = load("<float name=\"bin_width\" value=\"1\"/>").unwrap();
    let warnings = loaded.warnings.to_string();
    assert!(warnings.contains("'bin_width' has no effect"), "{warnings}");
}
