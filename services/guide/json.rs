//! Events for programs: a line of JSON each.

use super::{Ending, Show};
use anyhow::Result;
use gyro_model::guide::State;
use serde::Serialize;
use std::path::{Path, PathBuf};
use workbench::output::print;

/// Prints them.
pub(super) struct Json(PathBuf);

#[derive(Serialize)]
struct Event<'a, T> {
    schema: &'static str,
    #[serde(rename = "event")]
    kind: &'a str,
    #[serde(flatten)]
    rest: T,
}

#[derive(Serialize)]
struct Waits<'a> {
    log: &'a Path,
    says: &'a str,
}

#[derive(Serialize)]
struct Stands<'a> {
    log: &'a Path,
    source: Option<&'a str>,
    #[serde(flatten)]
    state: &'a State,
}

impl Json {
    pub fn new(log: &Path) -> Self {
        Self(log.to_owned())
    }

    fn give(kind: &str, rest: impl Serialize) -> Result<()> {
        print(&serde_json::to_string(&Event { schema: "truerate.guide/1", kind, rest })?)
    }
}

impl Show for Json {
    fn waits(&mut self, says: &str) -> Result<()> {
        Self::give("wait", Waits { log: &self.0, says })
    }

    fn state(&mut self, state: &State, source: Option<&str>) -> Result<()> {
        Self::give("state", Stands { log: &self.0, source, state })
    }

    fn end(&mut self, ending: &Ending) -> Result<()> {
        Self::give("end", ending)
    }
}
