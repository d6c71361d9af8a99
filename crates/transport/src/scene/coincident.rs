//! Surfaces that coincide with others: which of them a ray meets first never depends on the order of objects.
//!
//! A *sheet* is an object whose two sides are in the same medium: a meter's surface, a screen, an area light. A sheet that lies on
//! the face of a body, or on another sheet, is moved off it by about 1e-11 of the extent of the scene, so that rays meet both:
//! off a body to its outside, off a sheet to the side of that sheet's normal. Coincident faces of bodies stay where they are:
//! rays meet one of them, in the order of [`precedence`](super::index::precedence), and enter the medium that lies beyond all of them.

use super::index::{Index, sort_by_precedence};
use super::parts::{Object, Parts};
use crate::sampling::evenly_spread;
use crate::shape::{AreaSample, Shape, Tree};
use crate::stop::Stop;
use eikonal::Aabb;
use glam::DVec3;

/// Distance of a moved sheet from the surface below it, in units of the distance by which rays start off surfaces.
pub(super) const LAYER: f64 = 8.0;
/// Surfaces closer than this coincide, in the same unit.
pub(super) const TOUCH: f64 = 4.0;
/// Points of a surface at which others are looked for.
const POINTS: usize = 64;

/// Displacements of sheets off the surfaces with which they coincide.
#[derive(Debug, Default)]
pub(super) struct Separation {
    /// Numbers of sheets, each with a distance along its normals.
    moves: Vec<(usize, f64)>,
    /// The largest number of sheets that lie on one another on a surface.
    pub layers: usize,
}

impl Separation {
    /// Moves the sheets; returns their numbers, in increasing order, and their shapes before.
    pub(super) fn apply(self, parts: &mut Parts) -> Vec<(usize, Shape)> {
        let mut before = Vec::with_capacity(self.moves.len());
        for (sheet, distance) in self.moves {
            let shape = &mut parts.objects[sheet].shape;
            let moved = shape.moved_along_normals(distance);
            before.push((sheet, std::mem::replace(shape, moved)));
        }
        before.sort_by_key(|(sheet, _)| *sheet);
        before
    }
}

/// Finds the sheets that coincide with other surfaces, as far as it gets before `stop` is raised.
pub(super) fn separation(parts: &Parts, epsilon: f64, stop: &Stop) -> Separation {
    let sheets = sheets(parts);
    if sheets.is_empty() {
        return Separation::default();
    }
    let contacts = contacts(parts, &sheets, epsilon, stop);
    let mut layers = vec![0; parts.objects.len()];
    let mut moves = Vec::new();
    for (sheet, found) in sheets.iter().zip(&contacts) {
        let on_body = found.iter().any(|c| c.outward.is_some());
        let below = found.iter().filter_map(|c| c.sheet.map(|s| layers[s]));
        let Some(below) = below.chain(on_body.then_some(0)).max() else {
            continue;
        };
        layers[*sheet] = below + 1;
        moves.push((*sheet, side(found) * (below + 1) as f64 * LAYER * epsilon));
    }
    Separation {
        moves,
        layers: layers.into_iter().max().unwrap_or(0),
    }
}

/// Objects whose two sides are in the same medium, in the order in which they are put on one another: those that let
/// light through come after those that do not, and null surfaces last.
fn sheets(parts: &Parts) -> Vec<usize> {
    let mut sheets: Vec<usize> = (0..parts.objects.len())
        .filter(|i| parts.objects[*i].sides.is_none())
        .collect();
    sort_by_precedence(&mut sheets, &parts.objects);
    sheets
}

/// A place where a sheet coincides with another surface.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// Normal of the sheet.
    normal: DVec3,
    /// Unit normal to the outside of the body there, if it is one.
    outward: Option<DVec3>,
    /// The earlier sheet with which it coincides, if it is one, and its normal.
    sheet: Option<usize>,
    /// Unit normal of the other surface.
    other: DVec3,
}

/// The side to which a sheet is moved: 1 along its normal, −1 against it.
fn side(contacts: &[Contact]) -> f64 {
    let votes = |pick: &dyn Fn(&Contact) -> Option<DVec3>| -> f64 {
        let vote = |c: &Contact| pick(c).map(|to| c.normal.dot(to).signum());
        contacts.iter().filter_map(vote).sum()
    };
    let outside = votes(&|c| c.outward);
    let before = votes(&|c| c.sheet.map(|_| c.other));
    if outside != 0.0 {
        outside.signum()
    } else if before < 0.0 {
        -1.0
    } else {
        1.0
    }
}

/// Places where sheets coincide with bodies and with earlier sheets, in the order of the list of sheets.
fn contacts(parts: &Parts, sheets: &[usize], epsilon: f64, stop: &Stop) -> Vec<Vec<Contact>> {
    let mut search = Search::new(parts, sheets, epsilon);
    for k in (0..sheets.len()).take_while(|_| !stop.is_raised()) {
        search.bodies_below(k);
        search.sheets_beside(k);
    }
    search.sheets_on_bodies(stop);
    search.of_sheets
}

/// The search for contacts.
struct Search<'a> {
    objects: &'a [Object],
    sheets: &'a [usize],
    /// Places of objects in the list of sheets.
    rank: Vec<usize>,
    bodies: Index,
    all_sheets: Index,
    /// Those that let light through.
    passing_sheets: Index,
    /// Boxes around bodies, and around sheets.
    boxes: [Boxes; 2],
    /// Surfaces closer than this coincide.
    distance: f64,
    of_sheets: Vec<Vec<Contact>>,
}

impl<'a> Search<'a> {
    fn new(parts: &'a Parts, sheets: &'a [usize], epsilon: f64) -> Self {
        let objects = &parts.objects;
        let mut rank = vec![usize::MAX; objects.len()];
        for (k, sheet) in sheets.iter().enumerate() {
            rank[*sheet] = k;
        }
        let distance = TOUCH * epsilon;
        let boxes = |of: &dyn Fn(&Object) -> bool| {
            let all = objects.iter().filter(|o| of(o));
            Boxes::new(all.map(|o| o.shape.aabb().grown(distance)).collect())
        };
        Search {
            objects,
            sheets,
            rank,
            bodies: Index::new(objects, |o| o.sides.is_some()),
            all_sheets: Index::new(objects, |o| o.sides.is_none()),
            passing_sheets: Index::new(objects, |o| o.sides.is_none() && !o.bsdf.is_opaque()),
            boxes: [boxes(&|o| o.sides.is_some()), boxes(&|o| o.sides.is_none())],
            distance,
            of_sheets: vec![Vec::new(); sheets.len()],
        }
    }

    /// Bodies on whose faces the k-th sheet lies.
    fn bodies_below(&mut self, k: usize) {
        let sheet = &self.objects[self.sheets[k]];
        if !self.boxes[0].are_near(sheet) {
            return;
        }
        for sample in samples(sheet) {
            let (x, normal) = (sample.position, sample.normal);
            let found = self.bodies.touching(x, normal, self.distance, None);
            self.of_sheets[k].extend(found.map(|(body, other)| Contact {
                normal,
                outward: Some(outward(&self.objects[body], other)),
                sheet: None,
                other,
            }));
        }
    }

    /// Sheets with which the k-th one coincides, if one of the two lets light through to the other; of two that do not, the first in the
    /// order of precedence acts.
    fn sheets_beside(&mut self, k: usize) {
        let number = self.sheets[k];
        let sheet = &self.objects[number];
        let others = if sheet.bsdf.is_opaque() {
            &self.passing_sheets
        } else {
            &self.all_sheets
        };
        if others.objects.is_empty() || others.objects == [number] {
            return;
        }
        for sample in samples(sheet) {
            let (x, normal) = (sample.position, sample.normal);
            let Some((i, other)) = others.touching(x, normal, self.distance, Some(number)) else {
                continue;
            };
            let (upper, lower, normals) = if self.rank[i] < k {
                (k, i, [normal, other])
            } else {
                (self.rank[i], number, [other, normal])
            };
            self.of_sheets[upper].push(Contact {
                normal: normals[0],
                outward: None,
                sheet: Some(lower),
                other: normals[1],
            });
        }
    }

    /// Sheets that cover faces of bodies, looked for from the bodies.
    fn sheets_on_bodies(&mut self, stop: &Stop) {
        let bodies = self.objects.iter().filter(|o| o.sides.is_some());
        for body in bodies.take_while(|_| !stop.is_raised()) {
            if !self.boxes[1].are_near(body) {
                continue;
            }
            for sample in samples(body) {
                let (x, other) = (sample.position, sample.normal);
                let found = self.all_sheets.touching(x, other, self.distance, None);
                if let Some((sheet, normal)) = found {
                    self.of_sheets[self.rank[sheet]].push(Contact {
                        normal,
                        outward: Some(outward(body, other)),
                        sheet: None,
                        other,
                    });
                }
            }
        }
    }
}

/// Boxes, and the hierarchy over them.
struct Boxes {
    boxes: Vec<Aabb>,
    tree: Tree,
}

impl Boxes {
    fn new(boxes: Vec<Aabb>) -> Self {
        let tree = Tree::new(boxes.iter().copied());
        Boxes { boxes, tree }
    }

    /// Returns whether an object comes near one of the boxes.
    fn are_near(&self, object: &Object) -> bool {
        let own = object.shape.aabb();
        self.tree
            .any_near(&own, &mut |i| self.boxes[i].overlaps(&own))
    }
}

/// The normal of a body's surface to its outside.
fn outward(body: &Object, normal: DVec3) -> DVec3 {
    if body.shape.is_closed() && body.shape.has_flipped_normals() {
        -normal
    } else {
        normal
    }
}

/// Points that are spread evenly over a surface.
fn samples(object: &Object) -> impl Iterator<Item = AreaSample> + '_ {
    evenly_spread(POINTS).map(|u| object.shape.sample_area(u))
}
