//! The program's library: commands, services, and what they read and write.
//!
//! | module | noun |
//! | --- | --- |
//! | [`cli`] | the command line: what there is, and the exit code |
//! | [`commands`] | one command a file |
//! | [`report`] | results as text, JSON and one HTML page |

pub mod cli;
pub mod commands;
pub mod report;
