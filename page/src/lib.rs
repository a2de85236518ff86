//! truerate in a browser: requests and answers as JSON, files as bytes, over a handful of functions of WebAssembly.
//!
//! ```text
//! page.js (draws) ──▶ worker.js ──▶ border (bytes, JSON) ──▶ desk (a log on it) ──▶ workbench, as program and Python package do
//! ```
//!
//! Nothing here reads a clock, a file or an address: what is worked on is put in, and what is made is taken out.

// Checked by `cargo clippy` on every machine, built for a browser alone.
#![cfg(any(target_family = "wasm", clippy))]

mod border;
mod desk;
mod learner;
mod request;
mod rows;
mod told;
mod vehicle;
