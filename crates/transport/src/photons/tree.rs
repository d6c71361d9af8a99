//! In-place k-d tree of photons. The middle photon of a slice splits the slice across the longest
//! side of its box, which earlier splits have left.

use super::photon::Photon;
use eikonal::Aabb;

/// Maximum number of photons of a slice that is not split.
const MAX_LEAF_PHOTONS: usize = 8;
/// Number of photons above which two threads sort a slice.
const MIN_PARALLEL_PHOTONS: usize = 1 << 13;

/// Photons, in the order of the tree.
#[derive(Clone, Debug)]
pub struct PhotonTree {
    photons: Vec<Photon>,
    bounds: Aabb,
}

impl PhotonTree {
    /// Creates a tree of any number of photons.
    pub fn new(mut photons: Vec<Photon>) -> Self {
        let bounds = Aabb::around(photons.iter().map(|p| p.x));
        sort(&mut photons, bounds);
        PhotonTree { photons, bounds }
    }

    /// Returns the photons. Neighbours are close to one another.
    pub fn photons(&self) -> &[Photon] {
        &self.photons
    }

    /// Calls `found` with every photon in the boxes that are touched, and with few others.
    pub fn visit(&self, touches: impl Fn(&Aabb) -> bool, mut found: impl FnMut(&Photon)) {
        if !self.photons.is_empty() {
            visit(&self.photons, self.bounds, &touches, &mut found);
        }
    }
}

fn sort(photons: &mut [Photon], bounds: Aabb) {
    if photons.len() <= MAX_LEAF_PHOTONS {
        return;
    }
    let axis = longest(&bounds);
    let middle = photons.len() / 2;
    let by_place = |a: &Photon, b: &Photon| a.x[axis].total_cmp(&b.x[axis]);
    photons.select_nth_unstable_by(middle, by_place);
    let [below, above] = split(&bounds, axis, photons[middle].x[axis]);
    let parallel = photons.len() > MIN_PARALLEL_PHOTONS;
    // The middle photon stays in place and marks the split.
    let (low, high) = photons.split_at_mut(middle);
    let high = &mut high[1..];
    if parallel {
        rayon::join(|| sort(low, below), || sort(high, above));
    } else {
        sort(low, below);
        sort(high, above);
    }
}

fn visit(
    photons: &[Photon],
    bounds: Aabb,
    touches: &impl Fn(&Aabb) -> bool,
    found: &mut impl FnMut(&Photon),
) {
    if !touches(&bounds) {
        return;
    }
    if photons.len() <= MAX_LEAF_PHOTONS {
        photons.iter().for_each(found);
        return;
    }
    let axis = longest(&bounds);
    let middle = photons.len() / 2;
    let [below, above] = split(&bounds, axis, photons[middle].x[axis]);
    visit(&photons[..middle], below, touches, found);
    found(&photons[middle]);
    visit(&photons[middle + 1..], above, touches, found);
}

fn longest(bounds: &Aabb) -> usize {
    let size = bounds.size();
    (0..3).fold(0, |a, b| if size[b] > size[a] { b } else { a })
}

fn split(bounds: &Aabb, axis: usize, at: f64) -> [Aabb; 2] {
    let (mut below, mut above) = (*bounds, *bounds);
    below.max[axis] = at;
    above.min[axis] = at;
    [below, above]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;
    use glam::DVec3;

    fn photons(count: usize) -> Vec<Photon> {
        let mut sampler = Sampler::new(7, 0, 0);
        let mut next = || {
            DVec3::new(
                sampler.next_1d(),
                sampler.next_1d(),
                0.1 * sampler.next_1d(),
            )
        };
        (0..count).map(|_| Photon::at(next())).collect()
    }

    /// Every photon in a ball is found exactly once, for any number of photons.
    #[test]
    fn finds_what_a_search_of_all_finds() {
        for count in [0, 1, 8, 9, 17, 1000, 20_000] {
            let all = photons(count);
            let tree = PhotonTree::new(all.clone());
            let (center, radius) = (DVec3::new(0.4, 0.6, 0.02), 0.15);
            let inside = |p: &Photon| p.x.distance(center) <= radius;
            let mut found = Vec::new();
            tree.visit(
                |b| b.nearest_distance(center) <= radius,
                |p| found.extend(inside(p).then_some(p.x.to_array())),
            );
            let mut expected: Vec<_> = all
                .iter()
                .filter(|p| inside(p))
                .map(|p| p.x.to_array())
                .collect();
            let order = |a: &[f64; 3], b: &[f64; 3]| a[0].total_cmp(&b[0]);
            found.sort_by(order);
            expected.sort_by(order);
            assert_eq!(found, expected, "{count}");
        }
    }

    /// Photons may coincide.
    #[test]
    fn coincident_photons() {
        let tree = PhotonTree::new(vec![Photon::at(DVec3::ONE); 100]);
        let mut count = 0;
        tree.visit(|b| b.contains(DVec3::ONE), |_| count += 1);
        assert_eq!(count, 100);
    }
}
