//! Recordings: what a pipeline took in and gave out, in one MCAP file that Foxglove and Rerun open and that every command
//! reads as a log.
//!
//! | channel | one message | fields |
//! | --- | --- | --- |
//! | `/sample` | one row of the source | those of a log: `t_ns`, `gyro_x` …, the free channels by their names |
//! | `/estimate` | what kalman made of it | those of `apply`: `t_ns`, `rate_x` …, and `nis_x`, `flags_x`, `epoch` |
//!
//! Messages are protobuf, each field a `double` in the units of a log, NaN where there is no value; schemas stand in the file.
//! `t_ns` is the source's own time in whole nanoseconds, so nothing is lost on the way.

mod read;
mod schema;
mod write;

pub use read::{AsCsv, is_own};
pub use write::RecordingWriter;

use gyro_model::Axis;

/// The channel of the source's rows.
const SAMPLE: &str = "/sample";
/// The channel of the estimates.
const ESTIMATE: &str = "/estimate";

/// The columns of a sample, in order: those of a log.
fn sample_columns(gyros: &[Axis], free_names: &[String]) -> Vec<String> {
    let of_axes = |name: &str, axes: &[Axis]| -> Vec<String> { axes.iter().map(|a| format!("{name}_{a}")).collect() };
    let mut columns = of_axes("gyro", gyros);
    for name in ["ref_angle", "ref_rate", "accel"] {
        columns.extend(of_axes(name, &Axis::ALL));
    }
    columns.extend(["ref_qw", "ref_qx", "ref_qy", "ref_qz", "temp", "supply"].map(String::from));
    columns.extend(free_names.iter().cloned());
    columns
}

#[cfg(test)]
mod tests;
