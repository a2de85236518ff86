//! The program's library: commands, services, and what they read and write.
//!
//! Logs, model files and reports stand in a crate of their own, `workbench`.
//!
//! | module | noun |
//! | --- | --- |
//! | [`cli`], [`arguments`] | the command line: what there is, and the exit code; the flags that several commands share |
//! | [`commands`] | one command a file |
//! | [`progress`], [`browser`] | progress of long work, on a terminal; a report, in a browser |
//! | [`acquisition`], [`kalman`], [`compensator`], [`recorder`] | one process each, in the order of the flow |
//! | [`supervisor`] | starts, watches and restarts them |
//! | [`watch`], [`found`], [`ask`] | a look at a running pipeline; what it has found; a command to it, and its answer |
//! | [`demo`] | plays a user who finds out what is missing |
//! | [`settings`] | what a pipeline is told |
//! | [`realtime`] | what the kernel is asked for so that a rate comes in time |
//! | [`domain`], [`run_folder`] | where a pipeline lives, and its files |
//! | [`source`], [`live`] | where rows come from; those that come while they are read |
//! | [`listening`] | where a page is served: an address, or the first free port of a range |
//! | [`consumers`] | how far those are who follow |
//! | [`profile`] | when every sample was at every stage, as a trace |
//! | [`rate_out`], [`sender`] | the rate for a vehicle: shared memory, sockets, standard output |
//! | [`wire`] | between messages and mathematics |
//! | [`clock`], [`stop`], [`pulse`], [`vault`], [`hopeless`] | a process' clock, end, heart-beat, memory, last word |
//! | [`hops`] | round trips between two processes, ours beside others |
//! | [`guide`] | a recording that says what to do next |
//! | [`dashboard`] | the live page: what it shows, who may see it, what it orders |
//! | [`top`] | the same essentials in a terminal |

pub mod acquisition;
pub mod agreement;
pub mod arguments;
pub mod ask;
pub mod browser;
pub mod cli;
pub mod clock;
pub mod commands;
pub mod compensator;
pub mod consumers;
pub mod dashboard;
pub mod deadline;
pub mod demo;
pub mod domain;
pub mod found;
pub mod guide;
pub mod hopeless;
pub mod hops;
pub mod kalman;
pub mod listening;
pub mod live;
pub mod profile;
pub mod progress;
pub mod pulse;
pub mod rate_out;
pub mod realtime;
pub mod recorder;
pub mod run_folder;
pub mod sender;
pub mod settings;
pub mod source;
pub mod source_clock;
pub mod stop;
pub mod story;
pub mod supervisor;
pub mod top;
pub mod vault;
pub mod watch;
pub mod wire;
