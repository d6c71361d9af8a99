//! Queries of objects for parameters and children, and the messages for mistakes.

use crate::common::{child, object, read};
use glam::{DMat4, DVec3};
use morgana_io::diagnostic::lints;
use morgana_io::query::{Input, misplaced_plugin};
use morgana_io::schema::NumberRange;
use morgana_io::{Diagnostics, FileRegistry, PluginKind, Query, Severity, SpectrumValue, xml};

/// Queries an object. Returns the messages as `line:column severity message | help`.
fn ask(text: &str, questions: impl FnOnce(Query<'_, '_>)) -> Vec<String> {
    let object = object(text);
    let mut diagnostics = Diagnostics::new();
    questions(Query::new(&object, &mut diagnostics));
    let line = |d: &morgana_io::Diagnostic| {
        let at = d.location.as_ref().unwrap();
        // Columns from the start of the object's text.
        let column = if at.line() == 1 {
            at.column() - "<scene version='3.0.0'>".len()
        } else {
            0
        };
        let help = d.help.as_deref().unwrap_or("");
        format!("{column} {} {} | {help}", d.severity, d.message)
    };
    diagnostics.iter().map(line).collect()
}

#[test]
fn values_that_are_there() {
    let text = "<phase type='x'><float name='f' value='0.5'/><integer name='i' value='3'/>
        <boolean name='b' value='true'/><string name='s' value='b'/><point name='p' value='1 2 3'/>
        <vector name='v' value='4 5 6'/><rgb name='c' value='1 2 3'/>
        <transform name='t'><scale value='2'/></transform></phase>";
    let messages = ask(text, |mut q| {
        assert_eq!(q.float("f"), 0.5);
        assert_eq!(q.float("i"), 3.0);
        assert_eq!(q.float_within("f", NumberRange::POSITIVE, None), 0.5);
        assert_eq!(q.float_within("f", -1.0..=1.0, 9.0), 0.5);
        assert_eq!(q.integer("i"), 3);
        assert_eq!(q.integer_within("i", 0..4, 9), 3);
        assert!(q.boolean("b"));
        assert_eq!(q.string("s"), "b");
        assert_eq!(q.point("p"), DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(q.vector("v"), DVec3::new(4.0, 5.0, 6.0));
        assert_eq!(q.spectrum("c"), SpectrumValue::Rgb([1.0, 2.0, 3.0]));
        assert_eq!(q.spectrum("f"), SpectrumValue::Uniform(0.5));
        assert_eq!(q.transform("t"), DMat4::from_scale(DVec3::splat(2.0)));
        assert!(q.has("f") && !q.has("g"));
        q.finish(&[]);
    });
    assert_eq!(messages, [""; 0]);
}

#[test]
fn defaults_for_values_that_are_not_there() {
    let messages = ask("<phase type='x'/>", |mut q| {
        assert_eq!(q.float_or("f", 0.25), 0.25);
        assert_eq!(q.float_within("f", 0.0..1.0, 0.5), 0.5);
        assert_eq!(q.float_if_given("f"), None);
        assert_eq!(q.integer_or("i", -1), -1);
        assert!(q.boolean_or("b", true));
        assert_eq!(q.point_or("p", DVec3::X), DVec3::X);
        assert_eq!(q.vector_or("v", DVec3::Y), DVec3::Y);
        assert_eq!(q.transform("t"), DMat4::IDENTITY);
        assert!(q.child(PluginKind::Phase).is_none());
        assert!(q.role(PluginKind::Medium, "interior").is_none());
        q.finish(&[]);
    });
    assert_eq!(messages, [""; 0]);
}

/// The table of plugins contains the defaults of parameters.
#[test]
fn defaults_of_the_table() {
    let messages = ask("<film type='hdrfilm'/>", |mut q| {
        assert_eq!(q.integer("width"), 768);
        assert_eq!(q.word("pixel_format"), "rgb");
        assert!(q.boolean("sample_border") && !q.boolean("reweight"));
        // The default depends on other parameters, which the caller knows.
        assert_eq!(q.integer_or("crop_width", 7), 7);
    });
    assert_eq!(messages, [""; 0]);
    let messages = ask("<shape type='cylinder'/>", |mut q| {
        assert_eq!(q.point("p1"), DVec3::Z);
        assert_eq!(q.float("radius"), 1.0);
    });
    assert_eq!(messages, [""; 0]);
    let messages = ask("<bsdf type='diffuse'/>", |mut q| {
        assert_eq!(q.spectrum("reflectance"), SpectrumValue::Uniform(0.5));
    });
    assert_eq!(messages, [""; 0]);
}

/// After an error, the default replaces the value.
#[test]
fn limits_of_the_table() {
    let text = "<shape type='cylinder'><float name='radius' value='0'/></shape>";
    let messages = ask(text, |mut q| assert_eq!(q.float("radius"), 1.0));
    let expected = "52 error 'radius' is 0 but must be greater than 0 | ";
    assert_eq!(messages, [expected]);
}

#[test]
fn missing_values_are_reported_at_the_object() {
    let messages = ask(
        "<phase type='xy'><float name='qq' value='1'/></phase>",
        |mut q| {
            assert_eq!(q.float("q"), 1.0);
            assert_eq!(q.spectrum("c"), SpectrumValue::Uniform(1.0));
            assert_eq!(
                q.path("file", &mut FileRegistry::new()),
                std::path::Path::new("")
            );
            assert!(q.required_child(PluginKind::Film).is_none());
        },
    );
    assert_eq!(
        messages,
        [
            "2 error <phase type=\"xy\"> needs <float name=\"q\"> | is 'qq' meant for it?",
            "2 error <phase type=\"xy\"> needs <spectrum name=\"c\"> | ",
            "2 error <phase type=\"xy\"> needs <string name=\"file\"> | ",
            "2 error <phase type=\"xy\"> needs a <film> | ",
        ]
    );
}

#[test]
fn wrong_types_are_reported_at_the_value() {
    let text = "<phase type='xy'><string name='g' value='a'/><phase name='h' type='x'/></phase>";
    let messages = ask(text, |mut q| {
        assert_eq!(q.float_or("g", 0.5), 0.5);
        assert_eq!(q.float("h"), 1.0);
        assert!(q.role(PluginKind::Medium, "h").is_none());
        assert!(q.role(PluginKind::Medium, "g").is_none());
        q.texture_or_spectrum("h");
        q.finish(&[]);
    });
    assert_eq!(
        messages,
        [
            "42 error 'g': expected <float>, found <string> | ",
            "47 error 'h': expected <float>, found <phase> | ",
            "47 error 'h': expected <medium>, found <phase> | ",
            "42 error 'g': expected <medium>, found <string> | ",
            "47 error 'h': expected <texture> or <spectrum>, found <phase> | ",
        ]
    );
}

#[test]
fn values_out_of_range_are_reported() {
    let text = "<phase type='x'><float name='a' value='2'/><integer name='i' value='-7'/></phase>";
    let messages = ask(text, |mut q| {
        assert_eq!(q.float_within("a", 1e-4..=1.0, 0.1), 0.1);
        assert_eq!(q.float_within("a", ..0.0, None), 1.0);
        assert_eq!(q.float_within("i", NumberRange::POSITIVE, None), 1.0);
        assert_eq!(q.integer_within("i", -1.., 8), 8);
    });
    assert_eq!(
        messages,
        [
            "40 error 'a' is 2 but must be at least 0.0001 and at most 1 | ",
            "40 error 'a' is 2 but must be less than 0 | ",
            "69 error 'i' is -7 but must be greater than 0 | ",
            "69 error 'i' is -7 but must be at least -1 | ",
        ]
    );
}

#[test]
fn unknown_words_get_a_suggestion() {
    let text = "<volume type='gridvolume'><string name='filter_type' value='trilinar'/>\
                <string name='wrap_mode' value='a'/></volume>";
    let messages = ask(text, |mut q| {
        assert_eq!(q.word("filter_type"), "trilinear");
        assert_eq!(q.word("wrap_mode"), "clamp");
    });
    assert_eq!(
        messages,
        [
            "61 error 'filter_type' cannot be 'trilinar' | did you mean 'trilinear'?",
            "104 error 'wrap_mode' cannot be 'a' | it is one of: clamp, repeat, mirror",
        ]
    );
}

#[test]
fn names_of_other_programs_get_a_suggestion() {
    let text = "<medium type='homogeneous'><float name='mua' value='1'/><float name='mus' value='1'/>\
                <float name='mu_t' value='1'/></medium>";
    let messages = ask(text, |mut q| {
        q.spectrum("sigma_a");
        q.spectrum("sigma_s");
        q.finish(&[]);
    });
    let label = "<medium type=\"homogeneous\">";
    assert_eq!(
        messages,
        [
            format!("41 error {label} has no parameter 'mua' | did you mean 'sigma_a'?"),
            format!("70 error {label} has no parameter 'mus' | did you mean 'sigma_s'?"),
            // Suggest only parameters that the object has.
            format!("99 error {label} has no parameter 'mu_t' | it has: sigma_a, sigma_s"),
        ]
    );
}

#[test]
fn unused_parameters_and_children_are_reported() {
    let text = "<medium type='homogeneous'><float name='sigma_tt' value='1'/><float name='foo' value='1'/>\
                <float name='scale' value='1'/><bsdf type='null'/><volume name='albdo' type='v'/></medium>";
    let messages = ask(text, |mut q| {
        q.volume_or_spectrum("albedo");
        q.spectrum("sigma_t");
        q.finish(&["scale"]);
    });
    let label = "<medium type=\"homogeneous\">";
    assert_eq!(
        messages,
        [
            format!("41 error {label} has no parameter 'sigma_tt' | did you mean 'sigma_t'?"),
            format!("75 error {label} has no parameter 'foo' | it has: albedo, scale, sigma_t"),
            format!("104 warning 'scale' has no effect in this {label} | "),
            format!("123 error {label} takes no <bsdf> here | "),
            format!("142 error {label} has no <volume> 'albdo' | did you mean 'albedo'?"),
        ]
    );
}

#[test]
fn children_by_kind_and_by_role() {
    let scene = read(
        "<shape type='hull'><bsdf type='null'/><medium name='interior' type='a'/>\
         <medium name='exterior' type='b'/><emitter type='area'/></shape>",
    );
    let mut diagnostics = Diagnostics::new();
    let mut q = Query::new(&scene.root.children[0].object, &mut diagnostics);
    assert_eq!(q.role(PluginKind::Medium, "interior").unwrap().plugin, "a");
    assert_eq!(q.child(PluginKind::Medium).unwrap().plugin, "b");
    let bsdf = q.required_child(PluginKind::Bsdf).unwrap();
    assert_eq!(q.children(PluginKind::Emitter).len(), 1);
    q.finish(&[]);
    // Children outlive the query, so that assembly can use them.
    assert_eq!(bsdf.plugin, "null");
    assert!(diagnostics.is_empty(), "{diagnostics}");
}

#[test]
fn only_one_child_of_a_kind() {
    let text = "<shape type='cube'><bsdf type='a'/><bsdf type='b'/></shape>";
    let messages = ask(text, |mut q| {
        assert_eq!(q.child(PluginKind::Bsdf).unwrap().plugin, "a");
        q.finish(&[]);
    });
    let expected =
        "37 error <shape type=\"cube\"> takes only one <bsdf> | the first is at scene.xml:1:44";
    assert_eq!(messages, [expected]);
}

#[test]
fn a_volume_or_a_spectrum() {
    let text =
        "<medium type='m'><volume name='a' type='grid'/><float name='b' value='2'/></medium>";
    let messages = ask(text, |mut q| {
        let Input::Object(volume) = q.volume_or_spectrum("a") else {
            panic!()
        };
        assert_eq!(volume.plugin, "grid");
        let Input::Spectrum(value) = q.volume_or_spectrum("b") else {
            panic!()
        };
        assert_eq!(value, SpectrumValue::Uniform(2.0));
        let Input::Spectrum(value) = q.volume_or_spectrum("c") else {
            panic!()
        };
        assert_eq!(value, SpectrumValue::Uniform(1.0));
        q.finish(&[]);
    });
    assert_eq!(
        messages,
        ["2 error <medium type=\"m\"> needs <spectrum name=\"c\"> | "]
    );
}

#[test]
fn unknown_plugins_get_a_suggestion() {
    let object = object("<shape type='spere'/>");
    let mut diagnostics = Diagnostics::new();
    misplaced_plugin(&object, &["cube", "sphere"], &mut diagnostics);
    misplaced_plugin(&object, &["obj", "ply"], &mut diagnostics);
    let found: Vec<_> = diagnostics.iter().collect();
    assert_eq!(found[0].message, "unknown shape type 'spere'");
    let help = "did you mean 'sphere'? known types: cube, sphere";
    assert_eq!(found[0].help.as_deref(), Some(help));
    assert_eq!(found[1].help.as_deref(), Some("known types: obj, ply"));
    assert_eq!(found[0].location.as_ref().unwrap().text(), "spere");
}

#[test]
fn messages_of_the_caller_are_located() {
    let text = "<shape type='obj'><string name='filename' value='a.obj'/></shape>";
    let messages = ask(text, |mut q| {
        let error = morgana_io::Problem::Malformed("broken".into()).at("a.obj".as_ref());
        q.file_error("filename", &error);
        q.warning(lints::SMALL_GRID, "radius", "odd");
    });
    let expected = ["50 error a.obj: broken | ", "2 warning odd | "];
    assert_eq!(messages, expected);
}

#[test]
fn paths_start_at_the_file_that_mentions_them() {
    let folder = tempfile::tempdir().unwrap();
    let parts = folder.path().join("parts");
    std::fs::create_dir(&parts).unwrap();
    let main = "<scene version='3.0.0'><include filename='parts/v.xml'/></scene>";
    std::fs::write(folder.path().join("main.xml"), main).unwrap();
    let part = "<volume type='grid'><string name='filename' value='x.vol'/></volume>";
    std::fs::write(parts.join("v.xml"), part).unwrap();
    let mut diagnostics = Diagnostics::new();
    let scene = xml::load(&folder.path().join("main.xml"), &[], &mut diagnostics).unwrap();
    let mut files = FileRegistry::new();
    let volume = child(&scene.root, PluginKind::Volume);
    let path = Query::new(volume, &mut diagnostics).path("filename", &mut files);
    assert_eq!(path, parts.join("x.vol"));
    assert_eq!(files.paths().collect::<Vec<_>>(), [path]);
}

#[test]
fn warnings_do_not_count_as_errors() {
    let mut diagnostics = Diagnostics::new();
    diagnostics.push(morgana_io::Diagnostic::warning("w"));
    assert!(!diagnostics.has_errors() && !diagnostics.is_empty());
    assert_eq!(
        diagnostics.iter().next().unwrap().severity,
        Severity::Warning
    );
}

#[test]
fn the_number_of_messages_is_bounded() {
    let mut diagnostics = Diagnostics::new();
    let error = |i: usize| morgana_io::Diagnostic::error(format!("e{i}"));
    (0..250).for_each(|i| diagnostics.push(error(i)));
    // Messages are not repeated.
    diagnostics.push(error(7));
    assert_eq!(diagnostics.iter().count(), 100);
    assert_eq!(diagnostics.error_count(), 250);
    assert!(diagnostics.to_string().ends_with("... and 150 more\n"));
}
