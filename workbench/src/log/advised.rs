//! A log, or what it lacks and what to do about it.

use super::{LogError, Options, Provenance, error::Problem, refused, whole};
use gyro_model::{Record, diagnosis::DataFault};
use std::path::Path;

/// Reads a log (`-`: standard input): its rows, what is faulty in them, and where they come from.
///
/// # Errors
/// See [`super::Problem`]: unreadable, no usable header, text for a number, too few rows, more than a tenth of them faulty; with the command
/// that mends it where there is one.
pub fn read(path: &Path, options: &Options) -> Result<(Record, Vec<DataFault>, Provenance), LogError> {
    whole::read(path, options).map_err(|error| advised(path, options, error))
}

/// The same with `work` on the rows, beside the search for faults where rows are taken as a stream gives them.
///
/// # Errors
/// As [`read`]; what `work` gave is lost then.
pub fn read_beside<T>(
    path: &Path,
    options: &Options,
    work: impl FnOnce(&Record, &Provenance) -> T,
) -> Result<(Record, Vec<DataFault>, Provenance, T), LogError> {
    whole::read_beside(path, options, work).map_err(|error| advised(path, options, error))
}

fn advised(path: &Path, options: &Options, error: LogError) -> LogError {
    let faulty = faulty_times(path, options, &error);
    let (error, advice) = match refused::of_second(path, options, &error) {
        None => refused::of_file(path, options, error),
        advice => (error, advice),
    };
    let is_mended = advice.as_ref().is_some_and(|advice| !advice.left_out.is_empty());
    if let Some(faulty) = faulty.filter(|_| !is_mended) {
        return faulty;
    }
    // Of messages the names are those of their kinds, not of a text's columns.
    error.advised(advice, refused::is_text(path))
}

/// What is wrong with the times of a log without a reference: with such times none could be found.
fn faulty_times(path: &Path, options: &Options, error: &LogError) -> Option<LogError> {
    let is_of_reference = matches!(error.problem, Problem::NoReference { .. });
    if !is_of_reference || path == Path::new("-") || !options.advises {
        return None;
    }
    let alone = Options { needs_reference: false, ..options.clone() };
    whole::read(path, &alone).err().filter(|error| {
        matches!(
            error.problem,
            Problem::FewDigits { .. }
                | Problem::RepeatedTimes { .. }
                | Problem::StartsAgain { .. }
                | Problem::CountsRows { .. }
        )
    })
}
