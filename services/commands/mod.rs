//! One command a file, all alike: `Args` is what clap parses, `run` does it. What several share is in [`subject`] and
//! [`change`].
//!
//! To hook one in: the file and its `pub mod` here, a variant in [`crate::cli::Command`] and its arm in `run` there.
//! A command writes its result with [`print()`], never `println!`, so that `truerate … | head` ends quietly.

pub mod add;
pub mod apply;
pub mod bench;
pub mod change;
pub mod channels;
pub mod compare;
pub mod completions;
pub mod control;
pub mod demo;
pub mod diagnose;
pub mod effects;
pub mod evidence;
pub mod export;
pub mod fit;
pub mod fleet;
pub mod guide;
pub mod ladder;
pub mod man;
pub mod merge;
pub mod paper;
pub mod remove;
pub mod run;
pub mod service;
pub mod simulate;
pub mod status;
pub mod subject;
pub mod top;

pub use workbench::output::print;
