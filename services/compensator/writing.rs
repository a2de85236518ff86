//! Files that have to be there before a model counts.

use std::{fs, path::PathBuf};
use workbench::output::{For, write_for};

/// Files to write, each whole or not at all, in this order; and one that is of no use afterwards.
#[derive(Debug)]
pub struct Writing {
    /// Path and contents.
    pub files: Vec<(PathBuf, String)>,
    /// Whom they are for.
    pub for_whom: For,
    /// To be removed.
    pub spent: Option<PathBuf>,
}

impl Writing {
    /// Writes them.
    ///
    /// # Errors
    /// The first that cannot be written.
    pub fn carry_out(&self) -> anyhow::Result<()> {
        for (path, text) in &self.files {
            write_for(self.for_whom, path, text.as_bytes())?;
        }
        if let Some(path) = &self.spent {
            let _ = fs::remove_file(path);
        }
        Ok(())
    }
}
