//! Many light subpaths at once.

use crate::path::{BalanceSums, Bounds, LightPath, Workspace};
use crate::sampling::Sampler;
use crate::scene::Scene;
use crate::stats::Stats;
use crate::stop::Stop;
use rayon::prelude::*;

/// Light subpaths per unit of work.
const PER_TASK: usize = 256;

/// Light subpaths that are to be followed.
#[derive(Clone, Copy)]
pub(crate) struct LightPaths<'a> {
    /// The scene, at their instant.
    pub scene: &'a Scene,
    /// What ends all work.
    pub stop: &'a Stop,
    /// How they are sampled.
    pub bounds: Bounds,
    /// Number of them.
    pub count: usize,
    /// Probability with which connections are searched for further branches.
    pub search: f64,
    /// The random numbers of each.
    pub sampler: &'a (dyn Fn(u64) -> Sampler + Sync),
}

/// What became of them.
pub(crate) struct Followed<T> {
    /// What was kept.
    pub found: T,
    /// Counts.
    pub stats: Stats,
    /// Where their light went.
    pub balance: BalanceSums,
}

impl LightPaths<'_> {
    /// Follows them on the current thread pool, and keeps something of each on which light left. What it finds does not depend on
    /// the number of threads.
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
