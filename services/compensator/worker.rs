//! A thread that works beside the one that receives, at a bounded share of the time.

use std::{
    sync::mpsc::{Receiver, Sender, TryRecvError, channel},
    thread,
    time::{Duration, Instant},
};

/// The worker's end in the receiving thread: jobs in, results out. Dropping it ends the thread after its present job.
#[derive(Debug)]
pub struct Worker<J, R> {
    jobs: Sender<J>,
    results: Receiver<(R, Duration)>,
    busy: bool,
    rests_until: Instant,
    duty: f64,
}

impl<J: Send + 'static, R: Send + 'static> Worker<J, R> {
    /// Starts the thread; `duty` is the share of the time that it may work.
    #[must_use]
    pub fn start(duty: f64, mut work: impl FnMut(J) -> R + Send + 'static) -> Self {
        let (jobs, inbox) = channel::<J>();
        let (outbox, results) = channel();
        thread::spawn(move || {
            for job in inbox {
                let start = Instant::now();
                let result = work(job);
                if outbox.send((result, start.elapsed())).is_err() {
                    return;
                }
            }
        });
        Self { jobs, results, busy: false, rests_until: Instant::now(), duty }
    }

    /// Whether it works.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Whether it has nothing to do and has rested enough.
    #[must_use]
    pub fn is_ready(&self) -> bool {
        !self.busy && Instant::now() >= self.rests_until
    }

    /// Gives it a job.
    pub fn ask(&mut self, job: J) {
        self.busy = self.jobs.send(job).is_ok();
    }

    /// Its result, if it is done.
    ///
    /// # Errors
    /// Where the thread died.
    pub fn result(&mut self) -> anyhow::Result<Option<R>> {
        match self.results.try_recv() {
            Ok((result, took)) => {
                self.busy = false;
                self.rests_until = Instant::now() + took.mul_f64((1.0 - self.duty) / self.duty);
                Ok(Some(result))
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => anyhow::bail!("the thread that solves died"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Worker;

    #[test]
    fn a_worker_answers_and_a_dead_one_is_an_error() {
        let mut worker = Worker::start(1.0, |n: u32| 10 / n);
        worker.ask(5);
        let answer = loop {
            if let Some(answer) = worker.result().unwrap() {
                break answer;
            }
        };
        assert_eq!(answer, 2);
        worker.ask(0);
        while worker.result().is_ok_and(|r| r.is_none()) {}
        assert!(worker.result().is_err());
    }
}
