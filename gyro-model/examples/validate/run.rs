//! Trials in parallel, each with a name by which it can be run again alone.

use gyro_model::fit::FitError;
use std::{
    num::NonZero,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Instant,
};

/// One log, or a few that belong together.
pub struct Trial<T> {
    /// Parts with slashes between them: `delay/drive/3`.
    pub name: String,
    /// What it takes to run it.
    pub what: T,
}

/// How trials are run.
#[derive(Clone, Debug, clap::Args)]
pub struct Run {
    /// Of everything random.
    #[arg(long, default_value_t = 1, global = true)]
    pub seed: u64,
    /// Logs at the same time; all cores unless told.
    #[arg(long, global = true)]
    pub jobs: Option<usize>,
    /// Only the trials of this name, or whose name begins or ends with it: `delay`, `delay/drive`, `17`; a single one is
    /// told in detail.
    #[arg(long, global = true)]
    pub only: Option<String>,
}

impl Run {
    /// The seed of number `k` of this run.
    pub fn seed_of(&self, k: u64) -> u64 {
        crate::choice::seed_of(self.seed, k)
    }

    /// The results of those trials that are wanted, in order. `work` is told whether to print details.
    pub fn each<T: Sync, R: Send>(
        &self,
        trials: Vec<Trial<T>>,
        work: impl Fn(&Trial<T>, bool) -> Result<R, FitError> + Sync,
    ) -> Result<Vec<(Trial<T>, R)>, FitError> {
        let wanted: Vec<Trial<T>> = trials.into_iter().filter(|trial| self.wants(&trial.name)).collect();
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        let jobs = self.jobs.unwrap_or(cores).clamp(1, wanted.len().max(1));
        let alone = wanted.len() == 1;
        let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(wanted.len())));
        thread::scope(|scope| {
            for _ in 0..jobs {
                scope.spawn(|| {
                    while let Some(trial) = wanted.get(next.fetch_add(1, Ordering::Relaxed)) {
                        let began = Instant::now();
                        let result = work(trial, alone);
                        let Ok(mut done) = done.lock() else { return };
                        done.push((trial.name.as_str(), result));
                        let seconds = began.elapsed().as_secs_f64();
                        eprintln!("{}/{} {} {seconds:.1} s", done.len(), wanted.len(), trial.name);
                    }
                });
            }
        });
        let mut results = done.into_inner().unwrap_or_default();
        results.sort_by_key(|(name, _)| wanted.iter().position(|trial| trial.name == *name));
        let results: Result<Vec<R>, FitError> = results.into_iter().map(|(_, result)| result).collect();
        Ok(wanted.into_iter().zip(results?).collect())
    }

    fn wants(&self, name: &str) -> bool {
        let Some(only) = &self.only else { return true };
        let at = |rest: Option<&str>, edge: fn(&str) -> bool| rest.is_some_and(|rest| rest.is_empty() || edge(rest));
        at(name.strip_prefix(only.as_str()), |rest| rest.starts_with('/'))
            || at(name.strip_suffix(only.as_str()), |rest| rest.ends_with('/'))
    }
}
