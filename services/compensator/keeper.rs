//! A model counts once it is in its file, and not before: a crash cannot lose what was given. A disk may take its time over
//! that, so the files are written beside the stream.

use super::{
    current::Proposal,
    worker::{Cost, Rank, Worker},
    writing::Writing,
};
use gyro_model::Axis;
use ipc_types::diagnosis::Trial;

/// What is done once the files are there.
#[derive(Debug)]
pub enum Then {
    /// The parameters are given.
    Give,
    /// The run is over: rows of the last solution, errors before and after it.
    Finish(usize, Vec<(Axis, f64, f64, f64)>),
    /// A command is answered: its number, what to say.
    Answer(u64, String),
    /// The same of a trial that was won, which is told as given up where there is no file.
    TakeOver(u64, String, Box<Trial>),
}

/// A job: the files, the model that counts when they are there, what follows.
#[derive(Debug)]
pub struct Keeping {
    /// The files.
    pub writing: Writing,
    /// The next model, where there is one.
    pub proposal: Option<Proposal>,
    /// What follows.
    pub then: Then,
}

/// The thread.
pub type Keeper = Worker<Keeping, (Keeping, anyhow::Result<()>)>;

/// Starts it.
#[must_use]
pub fn start() -> Keeper {
    Worker::start(1.0, Cost::Thread, Rank::Behind, |keeping: Keeping| {
        let result = keeping.writing.carry_out();
        (keeping, result)
    })
}
