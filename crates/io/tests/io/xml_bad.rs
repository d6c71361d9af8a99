//! Scene files with mistakes: message, position and suggestion.

use crate::common::messages;
use morgana_io::{Diagnostic, Diagnostics, xml};

/// Returns `line:column message | help` for each mistake in a scene with these contents, which
/// begin at line 2, column 1.
fn mistakes(contents: &str) -> Vec<String> {
    let text = format!("<scene version='3.0.0'>\n{contents}\n</scene>");
    messages(&text).iter().map(describe).collect()
}

fn describe(diagnostic: &Diagnostic) -> String {
    let help = diagnostic.help.as_deref().unwrap_or("");
    match &diagnostic.location {
        Some(at) => format!(
            "{}:{} {} | {help}",
            at.line(),
            at.column(),
            diagnostic.message
        ),
        None => format!("{} | {help}", diagnostic.message),
    }
}

fn whole(text: &str) -> Vec<String> {
    messages(text).iter().map(describe).collect()
}

#[track_caller]
fn one(contents: &str, expected: &str) {
    assert_eq!(mistakes(contents), [expected]);
}

#[test]
fn syntax() {
    let mismatch = "2:20 invalid XML: expected the closing tag </shape>, found </scene> | ";
    assert_eq!(
        whole("<scene version='3.0.0'>\n<shape type='cube'></scene>"),
        [mismatch]
    );
    let early = "2:1 invalid XML: the file ends before its elements are closed | ";
    assert_eq!(whole("<scene version='3.0.0'>\n"), [early]);
    assert_eq!(
        whole(""),
        ["1:1 invalid XML: the file has no root element | "]
    );
    let attribute = "<scene version='3.0.0'>\n<shape type=cube/></scene>";
    assert!(
        whole(attribute)[0].starts_with("2:13 invalid XML: "),
        "{:?}",
        whole(attribute)
    );
    let twice = "<scene version='3.0.0'>\n<shape type='a' type='b'/></scene>";
    assert!(
        whole(twice)[0].starts_with("2:17 invalid XML: "),
        "{:?}",
        whole(twice)
    );
    let comment = "<scene version='3.0.0'>\n<!-- old -- new --></scene>";
    let expected = "2:1 invalid XML: '--' must not stand within a comment | ";
    assert_eq!(whole(comment), [expected]);
    let second = "<scene version='3.0.0'/>\n<shape type='cube'/>";
    let expected = "2:1 invalid XML: nothing may follow the end of the root element | ";
    assert_eq!(whole(second), [expected]);
}

#[test]
fn entities_are_refused() {
    let bomb = "<?xml version='1.0'?>\n<!DOCTYPE s [<!ENTITY a 'aaaa'><!ENTITY b '&a;&a;&a;'>]>\n\
                <scene version='&b;'/>";
    let expected = "2:1 invalid XML: document type declarations and entities are not accepted | ";
    assert_eq!(whole(bomb), [expected]);
}

#[test]
fn the_root_must_be_a_scene_of_a_known_version() {
    assert_eq!(
        whole("<shape type='a'/>"),
        ["1:2 expected <scene>, found <shape> | "]
    );
    assert_eq!(
        whole("<scene/>"),
        ["1:2 <scene> needs the attribute 'version' | "]
    );
    let help = "write version=\"3.0.0\" and use the parameter names of Mitsuba 3";
    let expected = format!("1:17 scenes of version '0.3.0' are not supported | {help}");
    assert_eq!(whole("<scene version='0.3.0'/>"), [expected]);
}

#[test]
fn unknown_elements() {
    one(
        "<shap type='a'/>",
        "2:2 unknown element <shap> | did you mean 'shape'?",
    );
    one("<gizmo><a/><b/></gizmo>", "2:2 unknown element <gizmo> | ");
    one("<scene version='3.0.0'/>", "2:2 unknown element <scene> | ");
    one(
        "words <!-- c -->",
        "2:1 text between elements has no meaning: remove it | ",
    );
    one(
        "<ref id='a'><float/></ref><shape id='a' type='b'/>",
        "2:13 <ref> cannot contain elements | ",
    );
}

#[test]
fn attributes() {
    one("<shape/>", "2:2 <shape> needs the attribute 'type' | ");
    one(
        "<shape type='a' ide='b'/>",
        "2:17 <shape> has no attribute 'ide' | did you mean 'id'?",
    );
    one(
        "<shape type='a'><float name='x' value='1' unit='m'/></shape>",
        "2:43 <float> has no attribute 'unit' | it takes: name, value",
    );
    one(
        "<shape type='a'><float value='1'/></shape>",
        "2:18 <float> needs the attribute 'name' | ",
    );
    one(
        "<shape type='a'><point name='x'/></shape>",
        "2:18 <point> needs the attribute 'value' or x, y, z | ",
    );
    one(
        "<shape type='a'><point name='x' x='1' value='1'/></shape>",
        "2:33 'x' and 'value' exclude each other | ",
    );
}

#[track_caller]
fn bad_value(tag: &str, value: &str, column: usize, message: &str) {
    let contents = format!("<shape type='a'>\n<{tag} name='x' value='{value}'/></shape>");
    let column = column + tag.len() + " name='x' value='".len() + 2;
    one(&contents, &format!("3:{column} {message} | "));
}

#[test]
fn numbers() {
    bad_value("float", "1.5m", 0, "'1.5m' is not a number");
    bad_value("float", "", 0, "expected one number");
    bad_value("float", "1 2", 0, "expected one number");
    bad_value("float", "nan", 0, "'nan' is not a finite number");
    bad_value("float", "inf", 0, "'inf' is not a finite number");
    bad_value("float", "1e999", 0, "'1e999' is not a finite number");
    bad_value("integer", "1.5", 0, "'1.5' is not a whole number");
    bad_value(
        "integer",
        "99999999999999999999",
        0,
        "'99999999999999999999' is not a whole number",
    );
    bad_value(
        "boolean",
        "yes",
        0,
        "expected 'true' or 'false', found 'yes'",
    );
    bad_value("vector", "1, 2", 0, "expected three numbers, found 2");
    bad_value("point", "1, two, 3", 3, "'two' is not a number");
}

#[test]
fn spectra() {
    bad_value("rgb", "1, 2", 0, "expected one or three numbers, found 2");
    bad_value("rgb", "#12345", 0, "'#12345' is not a colour like #ff8800");
    bad_value(
        "rgb",
        "#12345g",
        0,
        "'#12345g' is not a colour like #ff8800",
    );
    bad_value(
        "spectrum",
        "1 2",
        0,
        "expected one number, three, or pairs 'wavelength:value', found 2 numbers",
    );
    bad_value(
        "spectrum",
        "400:1, 500",
        7,
        "expected a pair 'wavelength:value', found '500'",
    );
    bad_value(
        "spectrum",
        "400:1, 400:2",
        7,
        "wavelengths must increase: 400 after 400",
    );
    bad_value("spectrum", "400:x", 4, "'x' is not a number");
}

#[track_caller]
fn bad_transform(part: &str, expected: &str) {
    one(
        &format!("<shape type='a'><transform name='t'>\n{part}</transform></shape>"),
        expected,
    );
}

#[test]
fn transforms() {
    bad_transform(
        "<translat x='1'/>",
        "3:2 a transform cannot contain <translat> | did you mean 'translate'?",
    );
    bad_transform(
        "<translate/>",
        "3:2 <translate> needs the attribute 'value' or x, y, z | ",
    );
    bad_transform(
        "<rotate x='1'/>",
        "3:2 <rotate> needs the attribute 'angle' | ",
    );
    bad_transform(
        "<rotate value='0' angle='1'/>",
        "3:2 the axis of a rotation must not be zero | ",
    );
    bad_transform("<scale x='0'/>", "3:2 a scale of zero cannot be undone | ");
    bad_transform(
        "<matrix value='1 2 3'/>",
        "3:16 expected 9 or 16 numbers (row by row), found 3 | ",
    );
    bad_transform(
        "<matrix value='1 0 0  0 0 0  0 0 1'/>",
        "3:16 the matrix cannot be inverted | ",
    );
    let help = "'target' must differ from 'origin', and 'up' must not be parallel to the view";
    let lookat =
        format!("3:2 'origin', 'target' and 'up' do not define a direction of view | {help}");
    bad_transform(
        "<lookat origin='1,1,1' target='1,1,1' up='0,1,0'/>",
        &lookat,
    );
    bad_transform(
        "<lookat origin='0,0,0' target='0,2,0' up='0,1,0'/>",
        &lookat,
    );
    bad_transform(
        "<lookat origin='0,0,0' up='0,1,0'/>",
        "3:2 <lookat> needs the attribute 'target' | ",
    );
    one(
        "<shape type='a'><transform name='t'>\n<scale value='1e200'/><scale value='1e200'/>\
         </transform></shape>",
        "2:18 the transform is not finite | ",
    );
}

#[test]
fn names_are_unique_in_an_object() {
    one(
        "<shape type='a'><float name='r' value='1'/>\n<integer name='r' value='1'/></shape>",
        "3:16 'r' is set twice in this <shape> | the first is at scene.xml:2:30",
    );
}

#[test]
fn references() {
    one(
        "<bsdf type='a' id='white'/>\n<ref id='whit'/>",
        "3:10 no object has the id 'whit' | did you mean 'white'?",
    );
    one(
        "<bsdf type='a' id='b'/>\n<bsdf type='c' id='b'/>",
        "3:20 the id 'b' is taken | the first object with this id is at scene.xml:2:20",
    );
    one(
        "<bsdf type='a' id='b'><ref id='b'/></bsdf>",
        "2:24 this object contains itself | ",
    );
    one("<alias id='a' as='b'/>", "2:12 no object has the id 'a' | ");
    assert_eq!(
        mistakes(
            "<bsdf type='a' id='b'><ref id='c'/></bsdf><bsdf type='a' id='c'><ref id='b'/></bsdf>"
        ),
        ["2:66 this object contains itself | "]
    );
}

#[test]
fn parameters() {
    one(
        "<default name='spp' value='1'/>\n<sampler type='$sp'/>",
        "3:16 parameter '$sp' is not defined | did you mean 'spp'?",
    );
    one(
        "<sampler type='a${sp}'/>",
        "2:17 parameter '$sp' is not defined | pass -D sp=..., or add <default name=\"sp\" value=\"...\"/>",
    );
    one(
        "<sampler type='$kind'><integer name='a' value='$n'/><integer name='b' value='$n'/></sampler>",
        "2:16 parameters '$kind', '$n' are not defined | \
         pass -D kind=... -D n=..., or add <default name=\"kind\" value=\"...\"/> and so on",
    );
    one("<sampler type='${sp'/>", "2:16 '${' without '}' | ");
    let mut diagnostics = Diagnostics::new();
    let text = "<scene version='3.0.0'><default name='width' value='1'/></scene>";
    let overrides = [("widht".to_owned(), "2".to_owned())];
    assert!(xml::parse(text, "s.xml", &overrides, &mut diagnostics).is_none());
    let found: Vec<_> = diagnostics.iter().map(describe).collect();
    let expected =
        "the scene has no parameter 'widht' (given as -D widht=...) | did you mean 'width'?";
    assert_eq!(found, [expected]);
}

#[test]
fn parameters_cannot_grow_without_bound() {
    let mut contents = "<default name='a0' value='0123456789'/>".to_owned();
    for i in 1..60 {
        let below = i - 1;
        contents += &format!("\n<default name='a{i}' value='$a{below}$a{below}'/>");
    }
    let found = mistakes(&contents);
    assert!(
        found[0].ends_with("the values of parameters become too long | "),
        "{}",
        found[0]
    );
}

#[test]
fn nesting_is_bounded() {
    let deep = |n: usize| "<bsdf type='a'>".repeat(n) + &"</bsdf>".repeat(n);
    let found = mistakes(&deep(10_000));
    assert_eq!(found.len(), 1);
    assert!(
        found[0].ends_with("elements are nested too deeply | "),
        "{}",
        found[0]
    );
    for order in [1, -1] {
        let mut chain: Vec<_> = (0..10_000)
            .map(|i| format!("<bsdf type='a' id='b{i}'><ref id='b{}'/></bsdf>\n", i + 1))
            .chain(["<bsdf type='a' id='b10000'/>".to_owned()])
            .collect();
        if order < 0 {
            chain.reverse();
        }
        let found = mistakes(&chain.concat());
        assert!(
            found[0].ends_with("references are nested too deeply | "),
            "{}",
            found[0]
        );
    }
}

#[test]
fn thousands_of_mistakes_take_no_time() {
    // Comparing every unknown id with every known one would take half a minute.
    let pair = |i| format!("<bsdf type='a' id='b{i}'/>\n<ref id='c{i}'/>\n");
    let found = mistakes(&(0..20_000).map(pair).collect::<String>());
    assert_eq!(found.len(), 100);
}

#[test]
fn several_mistakes_are_reported_at_once() {
    let found = mistakes(
        "<shape type='a'><float name='x' value='1m'/></shape>\n<shap/>\n<ref id='nobody'/>",
    );
    assert_eq!(found.len(), 3, "{found:?}");
}

mod files {
    use super::*;
    use std::path::PathBuf;

    /// Writes files to a folder and loads `main.xml`. Returns the messages with file names.
    fn load(files: &[(&str, &[u8])]) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            std::fs::write(folder.path().join(name), content).unwrap();
        }
        let mut diagnostics = Diagnostics::new();
        assert!(xml::load(&folder.path().join("main.xml"), &[], &mut diagnostics).is_none());
        let prefix = format!("{}/", folder.path().display());
        let name = |d: &Diagnostic| {
            let file = d
                .location
                .as_ref()
                .map_or(PathBuf::new(), |l| l.file().into());
            format!("{}:{}", file.display(), describe(d)).replace(&prefix, "")
        };
        diagnostics.iter().map(name).collect()
    }

    #[test]
    fn a_missing_scene() {
        let found = load(&[]);
        assert!(
            found[0].starts_with(":main.xml: cannot read: No such file"),
            "{found:?}"
        );
    }

    #[test]
    fn text_that_is_not_utf8() {
        let found = load(&[("main.xml", b"<scene\n \xff")]);
        let expected = ":main.xml:2: not UTF-8 text | save the file as UTF-8";
        assert_eq!(found, [expected]);
    }

    #[test]
    fn mistakes_in_an_included_file_are_located_there() {
        let main = b"<scene version='3.0.0'>\n<include filename='part.xml'/></scene>";
        let found = load(&[
            ("main.xml", main),
            ("part.xml", b"<scene>\n<shap/></scene>"),
        ]);
        assert_eq!(
            found,
            ["part.xml:2:2 unknown element <shap> | did you mean 'shape'?"]
        );
        let found = load(&[("main.xml", main), ("part.xml", b"<scene")]);
        assert!(found[0].starts_with("part.xml:1:"), "{found:?}");
    }

    #[test]
    fn a_missing_included_file() {
        let main = b"<scene version='3.0.0'>\n<include filename='no.xml'/></scene>";
        let found = load(&[("main.xml", main)]);
        assert!(
            found[0].starts_with("main.xml:2:20 no.xml: cannot read: "),
            "{found:?}"
        );
    }

    #[test]
    fn files_that_include_each_other() {
        let main = b"<scene version='3.0.0'><include filename='a.xml'/></scene>";
        let a = b"<scene><include filename='./main.xml'/></scene>";
        let found = load(&[("main.xml", main), ("a.xml", a)]);
        assert_eq!(found, ["a.xml:1:27 './main.xml' includes itself | "]);
    }

    #[test]
    fn inclusions_cannot_multiply_without_bound() {
        let twice = |n: usize| {
            format!("<scene><include filename='{n}.xml'/><include filename='{n}.xml'/></scene>")
        };
        let files: Vec<_> = (0..40)
            .map(|i| (format!("{i}.xml"), twice(i + 1)))
            .collect();
        let main = "<scene version='3.0.0'><include filename='0.xml'/></scene>";
        let mut all = vec![
            ("main.xml", main.as_bytes()),
            ("40.xml", b"<scene/>".as_slice()),
        ];
        all.extend(
            files
                .iter()
                .map(|(name, text)| (name.as_str(), text.as_bytes())),
        );
        let found = load(&all);
        assert!(
            found[0].ends_with("too many included files | "),
            "{found:?}"
        );
    }
}
