//! Times of tasks that take turns.

use std::time::Instant;

/// A batch of work; returns how many units it did.
pub type Task<'a> = Box<dyn FnMut() -> u64 + 'a>;

/// Seconds per unit of each task, for every round.
pub struct Times(Vec<Vec<f64>>);

/// Runs the tasks in turn for a number of rounds, after one that does not count. A disturbance of
/// the machine that lasts longer than a round changes all times alike, and no ratio.
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
    /// Median seconds per unit of a task.
    pub fn of(&self, task: usize) -> f64 {
        median(self.0[task].clone())
    }

    /// Median of the ratios of two tasks' times in the same round.
    pub fn ratio(&self, task: usize, to: usize) -> f64 {
        let pairs = self.0[task].iter().zip(&self.0[to]);
        median(pairs.map(|(a, b)| a / b).collect())
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
