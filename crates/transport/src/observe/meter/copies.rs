//! States of a particle and of its waiting copies.

/// States of a particle that may be divided on its path. Copies are followed one after the other,
/// the last first.
#[derive(Clone, Debug)]
pub(super) struct Copies<S> {
    /// State of the current copy.
    pub current: S,
    waiting: Vec<S>,
    /// True if the current copy continues; otherwise a waiting copy is next.
    continues: bool,
}

impl<S: Clone> Copies<S> {
    pub(super) fn new(current: S) -> Self {
        Copies {
            current,
            waiting: Vec::new(),
            continues: false,
        }
    }

    /// Starts a particle, whose state `reset` sets.
    pub(super) fn start(&mut self, reset: impl FnOnce(&mut S)) {
        self.waiting.clear();
        reset(&mut self.current);
        self.continues = true;
    }

    /// Continues with the next copy, along its next edge. Returns true if it is the copy that was
    /// followed before.
    pub(super) fn resume(&mut self) -> bool {
        let continues = std::mem::take(&mut self.continues);
        // Planted error "copies of particles that go on where another one ended", found by morgana-transport/transport::meters::records::copies_keep_their_own_ways_where_paths_are_cut:
        // if false && let Some(next) = self.waiting.pop() {
        if !continues && let Some(next) = self.waiting.pop() {
            self.current = next;
        }
        continues
    }

    /// Divides the particle into `copies` copies; 0 ends it.
    pub(super) fn continue_walk(&mut self, copies: usize) {
        for _ in 1..copies {
            self.waiting.push(self.current.clone());
        }
        self.continues = copies > 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_followed_one_after_the_other() {
        let mut copies = Copies::new(0);
        copies.start(|state| *state = 1);
        assert!(copies.resume());
        copies.continue_walk(3);
        // The first copy continues, is divided again, and ends.
        assert!(copies.resume());
        copies.current = 2;
        copies.continue_walk(2);
        assert!(copies.resume());
        copies.current = 3;
        let mut rest = Vec::new();
        for _ in 0..3 {
            assert!(!copies.resume());
            rest.push(copies.current);
        }
        assert_eq!(rest, [2, 1, 1]);
        copies.start(|state| *state = 5);
        assert!(copies.resume());
        assert_eq!(copies.current, 5);
    }
}
