//! The contract between the processes of a pipeline: bytes that cross a process border, and where they flow.
//!
//! ```text
//!                  Sample                Estimate
//! acquisition ───────────────▶ kalman ───────────────▶ recorder, dashboard, terminal, the vehicle
//!      │  ▲  ▲                  ▲  │
//!      │  │  └──────────────────┼──┘ Estimate: its sequence number is kalman's acknowledgement
//!      │  │ Command ⇄ Reply (hide)
//!      │  └── truerate control  │ Parameters (epoch n)
//!      │ Sample                 │
//!      └──────────────────▶ compensator ──▶ Diagnosis, report (JSON) ──▶ dashboard, terminal
//!                               ▲ Command ⇄ Reply (add, remove, undo, pause, resume, forget, save)
//!                               └── truerate control, dashboard
//!
//! every service ── Health ──▶ supervisor, acquisition (credit), watchers
//! supervisor ── Status ──▶ truerate status, terminal, dashboard
//! ```
//!
//! Messages are `#[repr(C)]`, `Copy`, without pointers, named and versioned, one a file. There is no logic here beyond
//! opening ports ([`port`], the only place that does) and saying where a pipeline lives ([`domain`]). Watchers only read.
//!
//! `NaN` stands for "no value", as in logs. Sequence numbers start at 1. Times that end in `_ns` without more are
//! nanoseconds of `CLOCK_MONOTONIC`; `time_ns` and `valid_ns` are nanoseconds from the source's first row.

mod ask;
mod bytes;
pub mod command;
pub mod diagnosis;
pub mod domain;
pub mod doorbell;
pub mod estimate;
pub mod health;
pub mod histogram;
pub mod parameters;
pub mod port;
mod port_error;
pub mod rate;
pub mod sample;
pub mod status;
mod stream;
pub mod text;
pub mod topic;
pub mod wait;

pub use command::{Command, Reply};
pub use diagnosis::Diagnosis;
pub use estimate::{AxisEstimate, Estimate};
pub use health::{Health, ServiceId, State};
pub use histogram::Histogram;
pub use parameters::Parameters;
pub use rate::RateRow;
pub use sample::Sample;
pub use status::Status;
pub use text::Text;

/// A data message of a stream.
pub const MARK_DATA: u32 = 0;
/// The end of a stream: no data, numbered like a message, passed on by every stage.
pub const MARK_END: u32 = 1;

/// FNV-1a of a message's source file: two programs talk only when both were built from the same definition.
#[must_use]
pub const fn schema(source: &str) -> u64 {
    let bytes = source.as_bytes();
    let (mut hash, mut i) = (0xcbf2_9ce4_8422_2325_u64, 0);
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0100_0000_01b3);
        i += 1;
    }
    hash
}
