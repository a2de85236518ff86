//! The program's library: commands, services, and what they read and write.
//!
//! | module | noun |
//! | --- | --- |
//! | [`cli`] | the command line: what there is, and the exit code |
//! | [`commands`] | one command a file |
//! | [`report`] | results as text, JSON and one HTML page |
//! | [`log`] | logs: CSV in, checked; CSV out |
//! | [`output`] | files that are written whole or not at all |
//! | [`plot`] | figures as SVG |
//! | [`toml_error`] | what is wrong in a TOML file, with line and caret |

pub mod cli;
pub mod commands;
pub mod log;
pub mod output;
pub mod plot;
pub mod report;
pub mod toml_error;
