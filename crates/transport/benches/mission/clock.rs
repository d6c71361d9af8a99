//! Processor time of tasks that take turns. On a busy machine wall time would include other
//! programs.

use cpu_time::ProcessTime;

/// Returns the processor time of each task in seconds for every round, except the first, which
/// warms up.
pub fn race(rounds: usize, tasks: &mut [&mut dyn FnMut()]) -> Vec<Vec<f64>> {
    let mut times = vec![Vec::new(); tasks.len()];
    for round in 0..=rounds {
        for (task, times) in tasks.iter_mut().zip(&mut times) {
            let start = ProcessTime::now();
            task();
            if round > 0 {
                times.push(start.elapsed().as_secs_f64());
            }
        }
    }
    times
}

pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
