//! Check for references that multiply objects: an object is built once for each path of references
//! to it.
//!
//! A bsdf, texture or field that is referenced twice is evaluated twice, and each object within it
//! again twice as often. References that double at each of sixty levels stand for 10¹⁸ objects.

use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::scene::{ObjectDescription, ObjectId, PluginKind, descendants};
use std::collections::{HashMap, HashSet};

/// Maximum number of repetitions of objects within one object. More repetitions are a mistake, and
/// the render would take too long.
const MAX_REPETITIONS: usize = 4096;

/// Reports every object in which objects repeat too often, unless it lies in another such object.
pub(super) fn check(root: &ObjectDescription, diagnostics: &mut Diagnostics) {
    let mut counter = Counter::default();
    counter.count(root);
    let Counter { counts, inner } = counter;
    let large = |o: &ObjectDescription| {
        !inner.contains(&o.number) && counts[&o.number] > MAX_REPETITIONS as f64
    };
    for object in descendants([root]).filter(|o| large(o)) {
        let (count, distinct) = (counts[&object.number], parts(object));
        if count - distinct as f64 > MAX_REPETITIONS as f64 {
            let message = format!(
                "the references in {} unfold to {count:.3e} objects, of which {distinct} are different",
                object.label()
            );
            let help = format!(
                "objects within one object may repeat {MAX_REPETITIONS} times: refer to fewer objects more than once"
            );
            diagnostics.push(Diagnostic::error(message).help(help).at(&object.location));
        }
    }
}

/// Returns true if a child is built again for each parent. Exceptions are the objects of the scene,
/// and objects that shapes share, because shapes are numerous.
fn repeats(parent: &ObjectDescription, child: &ObjectDescription) -> bool {
    match parent.kind {
        PluginKind::Scene => false,
        PluginKind::Shape => child.kind == PluginKind::Shape,
        _ => child.kind != PluginKind::Medium,
    }
}

/// Counter of the objects to which objects unfold.
#[derive(Default)]
struct Counter {
    /// Number of objects to which each object unfolds, including itself.
    counts: HashMap<ObjectId, f64>,
    /// Objects within an object that unfolds too far.
    inner: HashSet<ObjectId>,
}

impl Counter {
    fn count(&mut self, object: &ObjectDescription) -> f64 {
        if let Some(known) = self.counts.get(&object.number) {
            return *known;
        }
        let mut count = 1.0;
        for child in &object.children {
            let below = self.count(&child.object);
            if repeats(object, &child.object) {
                count += below;
                if below > MAX_REPETITIONS as f64 {
                    self.inner.insert(child.object.number);
                }
            }
        }
        self.counts.insert(object.number, count);
        count
    }
}

/// Returns the number of distinct objects in an object, including itself.
fn parts(object: &ObjectDescription) -> usize {
    let mut seen = HashSet::from([object.number]);
    let mut open = vec![object];
    while let Some(object) = open.pop() {
        let children = object.children.iter().map(|c| &*c.object);
        open.extend(children.filter(|c| repeats(object, c) && seen.insert(c.number)));
    }
    seen.len()
}
