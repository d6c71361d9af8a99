//! Tracing of many light subpaths.

use crate::path::{BalanceSums, Bounds, LightPath, Workspace};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::stats::Stats;
use crate::stop::Stop;
use rayon::prelude::*;

/// Light subpaths per task.
const PER_TASK: usize = 256;

/// Parameters of light subpaths to be traced.
#[derive(Clone, Copy)]
pub(crate) struct LightPaths<'a> {
    /// Scene, at the instant of the subpaths.
    pub scene: &'a Scene,
    /// Flag that ends all work.
    pub stop: &'a Stop,
    /// Limits of the sampled subpaths.
    pub bounds: Bounds,
    /// Number of subpaths.
    pub count: usize,
    /// Probability with which connections are searched for further branches.
    pub search: f64,
    /// Random numbers of each subpath.
    pub sampler: &'a (dyn Fn(u64) -> Sampler + Sync),
}

/// Results of traced subpaths.
pub(crate) struct Followed<T> {
    /// Results that were kept.
    pub found: T,
    /// Counts of events and failures.
    pub stats: Stats,
    /// Energy balance of the light.
    pub balance: BalanceSums,
}

impl LightPaths<'_> {
    /// Traces the subpaths on the current thread pool. Keeps the result of `keep` for each subpath
    /// with light. Results do not depend on the number of threads.
    pub(crate) fn follow<T: Send>(
        &self,
        keep: impl Fn(usize, LightPath) -> T + Sync,
    ) -> Followed<Vec<T>> {
        let part = |task: usize| {
            let mut ws = Workspace::new(self.scene.tolerance());
            ws.stop = self.stop.clone();
            ws.search = self.search;
            let (mut found, mut balance) = (Vec::new(), BalanceSums::default());
            for path in task * PER_TASK..self.count.min((task + 1) * PER_TASK) {
                if self.stop.is_raised() {
                    break;
                }
                let mut sampler = (self.sampler)(path as u64);
                let light =
                    LightPath::sample(self.scene, &self.bounds, &mut sampler, &mut ws, &mut ());
                found.extend(light.map(|light| keep(path, light)));
                balance.add(
                    &std::mem::take(&mut ws.particle_balance),
                    &mut ws.stats.not_finite,
                );
            }
            (found, ws.stats(), balance)
        };
        let tasks = (0..self.count.div_ceil(PER_TASK)).into_par_iter();
        let parts: Vec<(Vec<T>, Stats, BalanceSums)> = tasks.with_max_len(1).map(part).collect();
        let mut all = Followed {
            found: Vec::with_capacity(parts.iter().map(|part| part.0.len()).sum()),
            stats: Stats::default(),
            balance: BalanceSums::default(),
        };
        for (found, stats, balance) in parts {
            all.found.extend(found);
            all.stats += stats;
            all.balance += balance;
        }
        all
    }
}
