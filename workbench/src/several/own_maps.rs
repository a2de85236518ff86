//! Maps that are given for several logs, of which one may have names of its own: each log takes those whose channels it has.

use crate::{
    log::{LogError, Problem},
    subject::{Subject, Taken},
    words::given,
};
use anyhow::{Error, Result};
use gyro_model::words::shell_word;
use std::path::{Path, PathBuf};

/// A map of a channel that a log does not have, and others have.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unfit {
    /// The log, as it was named.
    pub log: String,
    /// The map, as it was given.
    pub map: String,
}

impl Unfit {
    /// What is said of it, of one log or of several.
    #[must_use]
    pub fn says(&self, logs: &str) -> String {
        format!("{logs}: read without {}: it has no such channel", given("map", &shell_word(&self.map)))
    }
}

/// Reads logs, each with the maps that fit it.
///
/// # Errors
/// A refused log, or a map that fits none of them.
pub fn read(paths: &[PathBuf], taken: &Taken, mut progress: impl FnMut(&Path)) -> Result<(Vec<Subject>, Vec<Unfit>)> {
    let (mut subjects, mut unfit, mut refused): (Vec<Subject>, Vec<Unfit>, Vec<Error>) = Default::default();
    for path in paths {
        progress(path);
        let mut own = taken.clone();
        let mut first = None;
        let subject = loop {
            match Subject::read(path, &own) {
                Ok(subject) => break subject,
                Err(error) => match missing(&error).filter(|map| own.options.map.contains(map)) {
                    Some(map) => {
                        own.options.map.retain(|other| *other != map);
                        unfit.push(Unfit { log: path.display().to_string(), map });
                        refused.push(error);
                        first.get_or_insert(refused.len() - 1);
                    }
                    // What its own names lack is told by the map that should have named it.
                    None => return Err(first.map_or(error, |first| refused.swap_remove(first))),
                },
            }
        };
        subjects.push(subject);
    }
    let of_none = |map: &String| unfit.iter().filter(|one| one.map == *map).count() == paths.len();
    if let Some(place) = unfit.iter().position(|one| of_none(&one.map)) {
        return Err(refused.swap_remove(place));
    }
    Ok((subjects, unfit))
}

/// The map whose channel a log does not have.
fn missing(error: &Error) -> Option<String> {
    match &error.downcast_ref::<LogError>()?.problem {
        Problem::NoChannel { flag, .. } => Some(flag.clone()),
        _ => None,
    }
}
