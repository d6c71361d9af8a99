//! XML Schema of scenes, checked by an interpreter of the subset that it uses: types of children,
//! and words of attributes.

use morgana_io::xml::xml_schema;
use roxmltree::{Document, Node};
use std::path::PathBuf;

/// Child elements of a name.
fn children<'a>(node: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |n| n.tag_name().name() == name)
}

/// The definition with a name.
fn named<'a>(nodes: impl Iterator<Item = Node<'a, 'a>>, name: &str) -> Option<Node<'a, 'a>> {
    let mut nodes = nodes;
    nodes.find(|n| n.attribute("name") == Some(name))
}

/// True if an attribute may have a value, by the name of its type.
fn allows(schema: Node, of_type: &str, value: &str) -> bool {
    if of_type == "xs:string" || value.contains('$') {
        return true;
    }
    let union = named(children(schema, "simpleType"), of_type).unwrap();
    let members = children(union, "union").next().unwrap();
    let members = members.attribute("memberTypes").unwrap();
    let words = named(children(schema, "simpleType"), &format!("{of_type}.word")).unwrap();
    let words = words
        .descendants()
        .filter(|n| n.has_tag_name(("http://www.w3.org/2001/XMLSchema", "enumeration")));
    let is_word = words
        .filter_map(|n| n.attribute("value"))
        .any(|word| word == value);
    is_word || members.ends_with("xs:string")
}

/// Collects the errors of an element of type `defined`, and of its descendants.
fn mistakes(schema: Node, defined: Node, element: Node, found: &mut Vec<String>) {
    let attributes: Vec<Node> = children(defined, "attribute").collect();
    for attribute in element.attributes() {
        let name = attribute.name();
        match named(attributes.iter().copied(), name) {
            None => found.push(format!("<{}> {name}", element.tag_name().name())),
            Some(known) if !allows(schema, known.attribute("type").unwrap(), attribute.value()) => {
                found.push(format!("{name}={}", attribute.value()));
            }
            Some(_) => {}
        }
    }
    let choice = children(defined, "choice").next();
    for child in element.children().filter(Node::is_element) {
        let tag = child.tag_name().name();
        let Some(choice) = choice else {
            // Skip steps of transforms, and contents of spectra.
            continue;
        };
        let Some(of_tag) = named(children(choice, "element"), tag) else {
            found.push(format!("<{tag}>"));
            continue;
        };
        let inline = children(of_tag, "complexType").next();
        let complex =
            inline.or_else(|| named(children(schema, "complexType"), of_tag.attribute("type")?));
        mistakes(schema, complex.unwrap(), child, found);
    }
}

/// Returns the errors that an editor would underline in a scene.
fn underlined(scene: &str) -> Vec<String> {
    let text = xml_schema();
    let document = Document::parse(&text).unwrap();
    let schema = document.root_element();
    let root = named(children(schema, "complexType"), "scene").unwrap();
    let mut found = Vec::new();
    let scene = Document::parse(scene).unwrap();
    mistakes(schema, root, scene.root_element(), &mut found);
    found
}

#[test]
fn example_scenes_are_valid() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let files = std::fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path());
    let scenes: Vec<PathBuf> = files
        .filter(|f| f.extension().is_some_and(|e| e == "xml"))
        .collect();
    assert!(scenes.len() > 10);
    for path in scenes {
        let scene = std::fs::read_to_string(&path).unwrap();
        assert_eq!(underlined(&scene), [""; 0], "{}", path.display());
    }
}

#[test]
fn mistakes_are_underlined() {
    let scene = r#"<scene version="3.0.0"><default name="n" value="3"/>
        <shape type="spere" id="s"><float name="radius" value="$n"/><flot name="radius" value="1"/>
        <medium name="interior" type="$kind"><float name="sigma" value="1"/></medium></shape></scene>"#;
    assert_eq!(underlined(scene), ["type=spere", "<flot>", "name=sigma"]);
}

/// Parameters of expressions may have any name.
#[test]
fn free_names_are_free() {
    let scene = r#"<scene version="3.0.0"><sampler type="independent"/><volume type="expression"><float name="speed" value="1"/></volume></scene>"#;
    assert_eq!(underlined(scene), [""; 0]);
}
