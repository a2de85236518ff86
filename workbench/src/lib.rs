//! Logs in, results out: what stands between the bytes of a file and the mathematics, and between a result and its reader.
//!
//! | module | noun |
//! | --- | --- |
//! | [`log`] | logs: CSV and other programs' formats in, checked; CSV out |
//! | [`recording`] | MCAP files: written, and read as logs |
//! | [`model_file`], [`toml_error`] | model files: TOML, strict; what is wrong in one, with line and caret |
//! | [`estimates`] | the columns of `apply` and of recordings |
//! | [`export`] | a model as C, for autopilots and for estimators |
//! | [`subject`], [`change`] | a log that is worked on: read, fitted, compared, diagnosed; effects added and removed |
//! | [`evidence`] | evidence files: what logs say, without the logs |
//! | [`fleet`] | what evidence says of types and parts, as text, JSON, page and type file |
//! | [`prior`], [`simulated_fleet`] | a part that starts from its type; a fleet whose truth is known |
//! | [`several`], [`sides`] | logs of one sensor, worked on together; two sensors beside each other |
//! | [`report`], [`plot`], [`web`] | results as text, JSON and one HTML page; figures as SVG; scripts and styles of the pages |
//! | [`motion`], [`agreement`] | of a stream: reference and model in even steps of time; whether its diagnosis has settled |
//! | [`vehicle`], [`story`] | simulated vehicles with a hidden effect; what was hidden beside what was found |
//! | [`words`] | how a refusal names what to do next: command, function or program |
//! | [`output`] | files that are written whole or not at all |
//! | [`files`], [`clock`] | where files are read from, and what time it is: the system, or the page that holds a browser's copy |
//!
//! Nothing here starts a process, opens a port or parses a command line. The program, the Python package and the page in a
//! browser stand on it.

pub mod agreement;
pub mod change;
pub mod clock;
pub mod estimates;
pub mod evidence;
pub mod export;
pub mod files;
pub mod fleet;
pub mod log;
pub mod model_file;
pub mod motion;
pub mod output;
#[cfg(not(target_family = "wasm"))]
pub mod plot;
pub mod prior;
pub mod recording;
pub mod report;
pub mod several;
pub mod sides;
pub mod simulated_fleet;
pub mod story;
pub mod subject;
pub mod toml_error;
pub mod vehicle;
pub mod web;
pub mod words;
