//! Rate limit.

use std::time::Instant;

/// Token bucket that fills at a constant rate; each request takes a token.
#[derive(Debug)]
pub(super) struct Bucket {
    rate: f64,
    capacity: f64,
    tokens: f64,
    filled: Instant,
}

impl Bucket {
    /// Makes a full bucket that fills by `rate` tokens per second.
    pub(super) fn new(rate: f64, capacity: f64) -> Self {
        Bucket {
            rate,
            capacity,
            tokens: capacity,
            filled: Instant::now(),
        }
    }

    /// Takes a token. Returns false if there is none.
    pub(super) fn take(&mut self, now: Instant) -> bool {
        let elapsed = now.saturating_duration_since(self.filled).as_secs_f64();
        self.filled = now;
        self.tokens = (self.tokens + self.rate * elapsed).min(self.capacity);
        let has_one = self.tokens >= 1.0;
        if has_one {
            self.tokens -= 1.0;
        }
        has_one
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_flood_is_held_to_the_rate() {
        let start = Instant::now();
        let mut bucket = Bucket::new(10.0, 5.0);
        let mut admitted = |time: f64, tries: usize| {
            let now = start + Duration::from_secs_f64(time);
            (0..tries).filter(|_| bucket.take(now)).count()
        };
        assert_eq!(admitted(1.0, 100), 5);
        assert_eq!(admitted(1.25, 100), 2);
        assert_eq!(admitted(9.0, 100), 5);
    }
}
