//! Which objects a ray meets.

use super::parts::Object;
use crate::shape::{Accel, Shape};

/// Some of the objects, for intersection tests.
#[derive(Debug)]
pub(super) struct Index {
    pub objects: Vec<usize>,
    /// Where each object is in the list.
    places: Vec<Option<usize>>,
    pub shapes: Vec<Shape>,
    pub accel: Accel,
}

impl Index {
    pub(super) fn new(objects: &[Object], keep: impl Fn(&Object) -> bool) -> Self {
        let all = objects.len();
        let (objects, shapes): (Vec<usize>, Vec<Shape>) = objects
            .iter()
            .enumerate()
            .filter(|(_, o)| keep(o))
            .map(|(i, o)| (i, o.shape.clone()))
            .unzip();
        let mut places = vec![None; all];
        for (place, object) in objects.iter().enumerate() {
            places[*object] = Some(place);
        }
        Index {
            accel: Accel::new(&shapes),
            objects,
            places,
            shapes,
        }
    }

    /// The place of an object in the list, if it is there.
    pub(super) fn place(&self, object: Option<usize>) -> Option<usize> {
        self.places[object?]
    }
}
