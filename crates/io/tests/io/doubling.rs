//! References that double at each level: sixty levels stand for 10¹⁸ objects. Such scenes are
//! refused at once.

use morgana_io::{Diagnostics, LoadOptions, json, xml};
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Time limit: far less than 2⁶⁰ operations of any kind take, and far more than reading sixty
/// objects takes.
const LIMIT: Duration = Duration::from_secs(5);

/// A chain of objects of a kind. Each, except the first, has two references to the previous one.
struct Chain {
    tag: &'static str,
    /// The first object, as type and parameters in XML and in JSON.
    leaf: [&'static str; 2],
    /// Type of the other objects, and their further content, in XML and in JSON.
    node: &'static str,
    needs: [&'static str; 2],
    /// Roles of the two references.
    roles: [&'static str; 2],
    /// The object that uses the last one, in the place of `$`, in XML and in JSON.
    user: [&'static str; 2],
}

const CHAINS: [Chain; 8] = [
    Chain {
        tag: "bsdf",
        leaf: ["'diffuse'>", r#""diffuse""#],
        node: "blendbsdf",
        needs: ["", ""],
        roles: ["a", "b"],
        user: [
            "<shape type='sphere'><ref id='$'/></shape>",
            r#"{"type": "sphere", "bsdf": {"type": "ref", "id": "$"}}"#,
        ],
    },
    Chain {
        tag: "bsdf",
        leaf: ["'diffuse'>", r#""diffuse""#],
        node: "twosided",
        needs: ["", ""],
        roles: ["a", "b"],
        user: [
            "<shape type='sphere'><ref id='$'/></shape>",
            r#"{"type": "sphere", "bsdf": {"type": "ref", "id": "$"}}"#,
        ],
    },
    Chain {
        tag: "texture",
        leaf: ["'checkerboard'>", r#""checkerboard""#],
        node: "checkerboard",
        needs: ["", ""],
        roles: ["color0", "color1"],
        user: [
            "<shape type='sphere'><bsdf type='diffuse'><ref id='$' name='reflectance'/></bsdf></shape>",
            r#"{"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": {"type": "ref", "id": "$"}}}"#,
        ],
    },
    Chain {
        tag: "texture",
        leaf: ["'checkerboard'>", r#""checkerboard""#],
        node: "checkerboard",
        needs: ["", ""],
        roles: ["color0", "color1"],
        user: [
            "<shape type='sphere'><emitter type='area'><ref id='$' name='radiance'/></emitter></shape>",
            r#"{"type": "sphere", "light": {"type": "area", "radiance": {"type": "ref", "id": "$"}}}"#,
        ],
    },
    Chain {
        tag: "phase",
        leaf: ["'rayleigh'>", r#""rayleigh""#],
        node: "blendphase",
        needs: ["<float name='weight' value='0.5'/>", r#""weight": 0.5, "#],
        roles: ["a", "b"],
        user: [
            "<shape type='sphere'><bsdf type='null'/><medium type='homogeneous' name='interior'><ref id='$'/></medium></shape>",
            r#"{"type": "sphere", "bsdf": {"type": "null"},
                "interior": {"type": "homogeneous", "phase": {"type": "ref", "id": "$"}}}"#,
        ],
    },
    Chain {
        tag: "volume",
        leaf: [
            "'linear'><float name='n0' value='1'/><vector name='slope' x='0'/>",
            r#""linear", "n0": 1, "slope": [0, 0, 0]"#,
        ],
        node: "sum",
        needs: ["", ""],
        roles: ["a", "b"],
        user: [
            "<shape type='sphere'><bsdf type='null'/><medium type='transparent' name='interior'>
             <ref id='$' name='ior'/></medium></shape>",
            r#"{"type": "sphere", "bsdf": {"type": "null"},
                "interior": {"type": "transparent", "ior": {"type": "ref", "id": "$"}}}"#,
        ],
    },
    Chain {
        tag: "shape",
        leaf: ["'sphere'>", r#""sphere""#],
        node: "shapegroup",
        needs: ["", ""],
        roles: ["a", "b"],
        user: [
            "<shape type='instance'><ref id='$'/></shape>",
            r#"{"type": "instance", "group": {"type": "ref", "id": "$"}}"#,
        ],
    },
    Chain {
        tag: "shape",
        leaf: ["'sphere'>", r#""sphere""#],
        node: "instance",
        needs: ["", ""],
        roles: ["a", "b"],
        user: [
            "<shape type='instance'><ref id='$'/></shape>",
            r#"{"type": "instance", "group": {"type": "ref", "id": "$"}}"#,
        ],
    },
];

impl Chain {
    /// Returns a scene of `levels` levels in XML.
    fn xml(&self, levels: usize) -> String {
        let Chain { tag, node, .. } = self;
        let mut text = format!(
            "<scene version='3.0.0'><{tag} id='x0' type={}</{tag}>\n",
            self.leaf[0]
        );
        for k in 1..levels {
            write!(text, "<{tag} id='x{k}' type='{node}'>{}", self.needs[0]).unwrap();
            for role in self.roles {
                write!(text, "<ref id='x{}' name='{role}'/>", k - 1).unwrap();
            }
            writeln!(text, "</{tag}>").unwrap();
        }
        let user = self.user[0].replace('$', &format!("x{}", levels - 1));
        text + &user
            + "<sensor type='perspective'><float name='fov' value='30'/><transform name='to_world'><translate z='-5'/></transform></sensor><emitter type='constant'/></scene>"
    }

    /// Returns a scene of `levels` levels in JSON.
    fn json(&self, levels: usize) -> String {
        let Chain { node, .. } = self;
        let mut text = format!(
            "{{\"type\": \"scene\", \"x0\": {{\"type\": {}}}",
            self.leaf[1]
        );
        for k in 1..levels {
            let reference = format!("{{\"type\": \"ref\", \"id\": \"x{}\"}}", k - 1);
            let [a, b] = self.roles;
            write!(
                text,
                ",\n\"x{k}\": {{\"type\": \"{node}\", {}\"{a}\": {reference}, \"{b}\": {reference}}}",
                self.needs[1]
            )
            .unwrap();
        }
        let user = self.user[1].replace('$', &format!("x{}", levels - 1));
        text + &format!(
            ",\n\"user\": {user}, \"sensor\": {{\"type\": \"perspective\", \"fov\": 30, \"to_world\": [{{\"translate\": [0, 0, -5]}}]}}, \"sky\": {{\"type\": \"constant\"}}}}"
        )
    }
}

/// Returns the messages about a scene in XML and in JSON; `None` if it can be rendered.
fn messages(chain: &Chain, levels: usize) -> [Option<String>; 2] {
    [true, false].map(|is_xml| {
        let mut diagnostics = Diagnostics::new();
        let scene = if is_xml {
            xml::parse(&chain.xml(levels), "scene.xml", &[], &mut diagnostics)
        } else {
            json::parse(&chain.json(levels), "scene.json", &[], &mut diagnostics)
        };
        let Some(scene) = scene else {
            return Some(diagnostics.to_string());
        };
        let loaded = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics);
        loaded.err().map(|d| d.to_string())
    })
}

#[test]
fn sixty_levels_are_refused_at_once() {
    let start = Instant::now();
    for chain in &CHAINS {
        for message in messages(chain, 60) {
            let message = message.expect("the scene was accepted");
            // 2⁶⁰ − 1 objects, and the shape around groups.
            assert!(
                message.contains("unfold to 1.153e18 objects, of which 6"),
                "{message}"
            );
            // One message, not one for each level.
            assert_eq!(message.matches("unfold").count(), 1, "{message}");
        }
    }
    assert!(start.elapsed() < LIMIT, "{:?}", start.elapsed());
}

/// A few levels are accepted, except groups within groups.
#[test]
fn ten_levels_are_what_they_stand_for() {
    for chain in CHAINS.iter().filter(|c| c.tag != "shape") {
        assert_eq!(messages(chain, 10), [None, None], "{}", chain.node);
        assert!(messages(chain, 14)[0].is_some(), "{}", chain.node);
    }
}

/// An object shared by many shapes is not a repetition within one object.
#[test]
fn thousands_of_shapes_share_a_surface() {
    let start = Instant::now();
    let mut text = CHAINS[0].xml(3);
    text.truncate(text.len() - "</scene>".len());
    for _ in 0..6000 {
        text += "<shape type='sphere'><ref id='x2'/></shape>";
    }
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(&(text + "</scene>"), "scene.xml", &[], &mut diagnostics);
    assert!(scene.is_some(), "{diagnostics}");
    assert!(start.elapsed() < LIMIT, "{:?}", start.elapsed());
}

/// Instances are copies: the numbers of groups and instances multiply, although each is
/// proportional to the file.
#[test]
fn too_many_copies_are_refused_before_they_are_made() {
    let start = Instant::now();
    let group = "<shape type='sphere'/>".repeat(4000);
    let instances = "<shape type='instance'><ref id='g'/></shape>".repeat(4000);
    let text = format!(
        "<scene version='3.0.0'><shape type='shapegroup' id='g'>{group}</shape>{instances}</scene>"
    );
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics).unwrap();
    let message = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics)
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("the instances make 16000000 shapes"),
        "{message}"
    );
    assert!(start.elapsed() < LIMIT, "{:?}", start.elapsed());
}

/// Emitters of one name get numbers in time proportional to their number.
#[test]
fn thousands_of_lights_have_names() {
    let start = Instant::now();
    let light = "<emitter type='point'><float name='intensity' value='1'/></emitter>";
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='30'/></sensor>
         <emitter type='point' id='point_3'><float name='intensity' value='1'/></emitter>{}</scene>",
        light.repeat(5000)
    );
    let mut diagnostics = Diagnostics::new();
    let scene = xml::parse(&text, "scene.xml", &[], &mut diagnostics).unwrap();
    let loaded = morgana_io::assemble(&scene, &LoadOptions::default(), diagnostics).unwrap();
    assert_eq!(
        loaded.emitter_names[..4],
        ["point_3", "point", "point_2", "point_4"]
    );
    assert_eq!(loaded.emitter_names[5000], "point_5001");
    assert!(start.elapsed() < LIMIT, "{:?}", start.elapsed());
}
