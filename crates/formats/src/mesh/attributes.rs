//! Quantities of the vertices and faces of a mesh, with the names that Mitsuba 3 gives to
//! quantities of PLY files.

/// Quantity of all vertices, or of all triangles, of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshAttribute {
    /// Name of the attribute, which begins with `vertex_` or `face_`.
    pub name: String,
    /// True if the attribute has one channel, which is three times in `values`; false if it has
    /// three channels.
    pub is_number: bool,
    /// Values of all vertices, or of all triangles.
    pub values: Vec<[f32; 3]>,
}

impl MeshAttribute {
    /// Makes an attribute of colours.
    pub fn colours(name: &str, values: Vec<[f32; 3]>) -> Self {
        MeshAttribute {
            name: name.to_owned(),
            is_number: false,
            values,
        }
    }

    /// Returns true if there is a value for each triangle, false if for each vertex.
    pub fn is_of_faces(&self) -> bool {
        self.name.starts_with("face_")
    }
}

/// Suffixes of successive channels in names such as `velocity_x`.
const SCHEMES: [&str; 4] = ["xyzw", "rgba", "0123", "1234"];
/// Suffixes of colour channels.
const OF_COLOURS: &str = "rgba";

/// Adjacent properties of an element that are channels of one quantity.
pub(super) struct Channels {
    /// Name of the attribute.
    pub name: String,
    /// Index of the first channel among the properties.
    pub first: usize,
    /// Number of channels.
    pub count: usize,
}

/// Returns the quantities of one or three channels among properties, in their order; `kind` is
/// `vertex` or `face`.
pub(super) fn grouped(kind: &str, properties: &[&str]) -> Vec<Channels> {
    let mut groups: Vec<Channels> = Vec::new();
    let mut k = 0;
    while k < properties.len() {
        let Some((prefix, scheme)) = first_of(properties[k]) else {
            k += 1;
            continue;
        };
        let follows = |(letter, property): (char, &&str)| {
            property.strip_prefix(prefix) == Some(&format!("_{letter}"))
        };
        let rest = scheme.chars().zip(&properties[k..]);
        let count = rest.take_while(|pair| follows(*pair)).count();
        let colour = if scheme == OF_COLOURS { "_color" } else { "" };
        let name = format!("{kind}_{prefix}{colour}");
        if [1, 3].contains(&count) && groups.iter().all(|g| g.name != name) {
            let first = k;
            groups.push(Channels { name, first, count });
        }
        k += count;
    }
    groups
}

/// Returns the prefix of a property that is the first channel of a quantity, and the suffixes of
/// the channels.
fn first_of(property: &str) -> Option<(&str, &'static str)> {
    let (prefix, letter) = property.rsplit_once('_')?;
    let scheme = SCHEMES.iter().find(|s| s.get(..1) == Some(letter))?;
    Some((prefix, scheme))
}
