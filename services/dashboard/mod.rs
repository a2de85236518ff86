//! dashboard: watches the pipeline and shows it in a browser; sends what is ordered there.
//!
//! ```text
//! topics ─▶ feed ─▶ scene ─▶ server ─▶ pages (SSE)        one thread watches, one serves
//!                             └─▶ orders ─▶ commander ─▶ compensator, acquisition (request–response)
//! ```
//!
//! It only reads, and asks as `truerate control` does: when it dies or hangs nobody notices.

pub mod guard;
pub mod judgement;
pub mod model;
pub mod motion;
pub mod order;
pub mod scene;
pub mod server;
