//! Interleaved timing of several tasks.

use std::time::Instant;

/// A batch of work. It returns the number of units done.
pub type Task<'a> = Box<dyn FnMut() -> u64 + 'a>;

/// Seconds per unit of each task, for every round.
pub struct Times(Vec<Vec<f64>>);

/// Runs the tasks in turn for a number of rounds, after one round of warm-up. A disturbance that
/// lasts longer than a round changes all times in proportion, and leaves their ratios unchanged.
pub fn race(rounds: usize, tasks: &mut [Task]) -> Times {
    let mut times = vec![Vec::new(); tasks.len()];
    for round in 0..=rounds {
        for (task, times) in tasks.iter_mut().zip(&mut times) {
            let start = Instant::now();
            let units = task();
            if round > 0 {
                times.push(start.elapsed().as_secs_f64() / units as f64);
            }
        }
    }
    Times(times)
}

impl Times {
    /// Returns the median time of a task, in seconds per unit.
    pub fn of(&self, task: usize) -> f64 {
        median(self.0[task].clone())
    }

    /// Returns the median over the rounds of the ratio of two tasks' times.
    pub fn ratio(&self, task: usize, to: usize) -> f64 {
        let pairs = self.0[task].iter().zip(&self.0[to]);
        median(pairs.map(|(a, b)| a / b).collect())
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
