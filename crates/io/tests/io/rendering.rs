//! Appearance of typical mistakes on a terminal.

use morgana_io::diagnostic::Style;
use morgana_io::query::misplaced_plugin;
use morgana_io::{Diagnostic, Diagnostics, ObjectDescription, PluginKind, Query, xml};

/// Renders the messages for a small scene with mistakes in plugin, parameters and values.
fn render(text: &str, style: Style) -> String {
    let mut diagnostics = Diagnostics::new();
    if let Some(scene) = xml::parse(text, "scene.xml", &[], &mut diagnostics) {
        for child in &scene.root.children {
            ask(&child.object, &mut diagnostics);
        }
    }
    diagnostics.render(style)
}

fn ask(object: &ObjectDescription, diagnostics: &mut Diagnostics) {
    match object.plugin.as_str() {
        "homogeneous" => {
            let mut query = Query::new(object, diagnostics);
            query.volume_or_spectrum("sigma_t");
            query.volume_or_spectrum("albedo");
            query.float("scale");
            query.child(PluginKind::Phase);
            query.finish(&[]);
        }
        _ => misplaced_plugin(object, &["homogeneous", "heterogeneous"], diagnostics),
    }
}

fn plain(body: &str) -> String {
    render(
        &format!("<scene version=\"3.0.0\">\n{body}\n</scene>\n"),
        Style::Plain,
    )
}

#[test]
fn a_misspelt_parameter() {
    insta::assert_snapshot!(plain(
        "  <medium type=\"homogeneous\">\n    <float name=\"sigma_tt\" value=\"1.1\"/>\n  </medium>"
    ));
}

#[test]
fn a_misspelt_plugin() {
    insta::assert_snapshot!(plain("  <medium type=\"homogenous\"/>"));
}

#[test]
fn a_value_out_of_range() {
    insta::assert_snapshot!(plain(
        "  <medium type=\"homogeneous\">\n    <float name=\"sigma_t\" value=\"1\"/>\n\
         \t<float name=\"scale\" value=\"-2\"/>\n  </medium>"
    ));
}

#[test]
fn a_reference_to_nothing() {
    insta::assert_snapshot!(plain(
        "  <medium type=\"homogeneous\" id=\"fog\"/>\n  <shape type=\"cube\"><ref id=\"fgo\"/></shape>"
    ));
}

#[test]
fn junk_in_a_number() {
    insta::assert_snapshot!(plain(
        "  <emitter type=\"point\">\n    <rgb name=\"intensity\" value=\"10, 1O, 10\"/>\n  </emitter>"
    ));
}

#[test]
fn an_undefined_parameter() {
    insta::assert_snapshot!(plain(
        "  <default name=\"spp\" value=\"16\"/>\n  <sampler type=\"independent\">\n    \
         <integer name=\"sample_count\" value=\"$ssp\"/>\n  </sampler>"
    ));
}

#[test]
fn an_element_that_is_not_closed() {
    insta::assert_snapshot!(plain("  <shape type=\"cube\">"));
}

#[test]
fn colours() {
    let text = "<scene version='3.0.0'><medium type='homogenous'/></scene>";
    insta::assert_snapshot!(render(text, Style::Colour).replace('\x1b', "ESC"));
}

#[test]
fn long_lines_are_cut_around_the_place() {
    let pad = " ".repeat(300);
    insta::assert_snapshot!(plain(&format!("<!--{pad}--><shap type='a'/><!--{pad}-->")));
}

#[test]
fn carets_are_below_wide_characters() {
    let text = plain("<!-- 光の屈折 --><shap type='球'/>");
    let lines: Vec<&str> = text.lines().collect();
    let marks = lines.iter().position(|line| line.contains('^')).unwrap();
    let before = lines[marks - 1].split("shap").next().unwrap();
    // Four characters take two cells each.
    let cells = before.chars().count() + 4;
    assert_eq!(lines[marks].find('^'), Some(cells), "{text}");
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    let mut diagnostics = Diagnostics::new();
    diagnostics.push(Diagnostic::error("a \x1b[31m name").help("b\x07".to_owned()));
    assert!(!diagnostics.to_string().contains(['\x1b', '\x07']));
}

#[test]
fn no_colours_without_a_terminal() {
    assert_eq!(Style::detect(false), Style::Plain);
}
