//! Coincident surfaces. The surface that a ray meets first never depends on the order of objects.
//!
//! A *sheet* is an object with one medium on both sides: a meter's surface, a screen, an area
//! light. If a sheet lies on the face of a body, or on another sheet, it is moved off this surface
//! by about 1e-11 of the extent of the scene. Rays then meet both. A sheet is moved to the outside
//! of a body, or to the side of the other sheet's normal. Coincident faces of bodies stay in place.
//! Rays meet one of them, in the order of [`precedence`](super::index::precedence), and enter the
//! medium beyond all of them.

use super::index::{Index, sort_by_precedence};
use super::parts::{Object, Parts};
use crate::sampling::evenly_spread;
use crate::shape::{AreaSample, Shape, Tree};
use crate::stop::Stop;
use eikonal::Aabb;
use glam::DVec3;

/// Distance of a moved sheet from the surface below it, in units of the distance by which rays
/// start off surfaces.
pub(super) const LAYER: f64 = 8.0;
/// Distance below which surfaces coincide, in units of the distance by which rays start off
/// surfaces.
pub(super) const TOUCH: f64 = 4.0;
/// Number of points of a surface at which other surfaces are searched for.
const POINTS: usize = 64;

/// Displacements of sheets off the surfaces with which they coincide.
#[derive(Debug, Default)]
pub(super) struct Separation {
    /// Indices of sheets, each with a distance along its normals.
    moves: Vec<(usize, f64)>,
    /// Largest number of sheets that lie on one another.
    pub layers: usize,
}

impl Separation {
    /// Moves the sheets. Returns their indices, in increasing order, and their shapes before the
    /// move.
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

/// Finds the sheets that coincide with other surfaces, or those found before `stop` is raised.
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

/// Returns the objects with one medium on both sides, in the order in which they are stacked.
/// Opaque objects come first, then objects that transmit light, and null surfaces last.
fn sheets(parts: &Parts) -> Vec<usize> {
    let mut sheets: Vec<usize> = (0..parts.objects.len())
        .filter(|i| parts.objects[*i].sides.is_none())
        .collect();
    sort_by_precedence(&mut sheets, &parts.objects);
    sheets
}

/// A point where a sheet coincides with another surface.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// Normal of the sheet.
    normal: DVec3,
    /// Unit normal towards the outside of the body at the point, if the other surface belongs to a
    /// body.
    outward: Option<DVec3>,
    /// Earlier sheet with which the sheet coincides, if the other surface is one.
    sheet: Option<usize>,
    /// Unit normal of the other surface.
    other: DVec3,
}

/// Returns the side to which a sheet is moved: 1 along its normal, −1 against it.
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

/// Returns the points where sheets coincide with bodies and with earlier sheets, in the order of
/// the list of sheets.
fn contacts(parts: &Parts, sheets: &[usize], epsilon: f64, stop: &Stop) -> Vec<Vec<Contact>> {
    let mut search = Search::new(parts, sheets, epsilon);
    for k in (0..sheets.len()).take_while(|_| !stop.is_raised()) {
        search.bodies_below(k);
        search.sheets_beside(k);
    }
    search.sheets_on_bodies(stop);
    search.of_sheets
}

/// State of the search for contacts.
struct Search<'a> {
    objects: &'a [Object],
    sheets: &'a [usize],
    /// Position of each object in the list of sheets.
    rank: Vec<usize>,
    bodies: Index,
    all_sheets: Index,
    /// Sheets that transmit light.
    passing_sheets: Index,
    /// Boxes around bodies, and around sheets.
    boxes: [Boxes; 2],
    /// Distance below which surfaces coincide.
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

    /// Finds bodies on whose faces the k-th sheet lies.
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

    /// Finds sheets with which the k-th sheet coincides, if one of the two transmits light to the
    /// other. Of two opaque sheets, the first in the order of precedence acts.
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

    /// Finds sheets that cover faces of bodies, by searching from the bodies.
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

    /// Returns true if an object lies near one of the boxes.
    fn are_near(&self, object: &Object) -> bool {
        let own = object.shape.aabb();
        self.tree
            .any_near(&own, &mut |i| self.boxes[i].overlaps(&own))
    }
}

/// Returns the normal of a body's surface towards the outside.
fn outward(body: &Object, normal: DVec3) -> DVec3 {
    if body.shape.is_closed() && body.shape.has_flipped_normals() {
        -normal
    } else {
        normal
    }
}

/// Returns points that are spread evenly over a surface.
fn samples(object: &Object) -> impl Iterator<Item = AreaSample> + '_ {
    evenly_spread(POINTS).map(|u| object.shape.sample_area(u))
}
