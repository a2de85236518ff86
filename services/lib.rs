//! The program's library: commands, services, and what they read and write.
//!
//! | module | noun |
//! | --- | --- |
//! | [`cli`] | the command line: what there is, and the exit code |
//! | [`commands`] | one command a file |
//! | [`progress`] | progress of long work, on a terminal |
//! | [`report`] | results as text, JSON and one HTML page |
//! | [`estimates`] | the columns of `apply` and of recordings |
//! | [`dashboard`] | the live page: what it shows, who may see it, what it orders |
//! | [`log`] | logs: CSV in, checked; CSV out |
//! | [`model_file`] | model files: TOML, strict |
//! | [`output`] | files that are written whole or not at all |
//! | [`plot`] | figures as SVG |
//! | [`toml_error`] | what is wrong in a TOML file, with line and caret |

pub mod cli;
pub mod commands;
pub mod dashboard;
pub mod estimates;
pub mod log;
pub mod model_file;
pub mod output;
pub mod plot;
pub mod progress;
pub mod report;
pub mod toml_error;
