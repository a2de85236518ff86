//! The columns of `truerate apply` and of `run --record`: the same rows, byte for byte.

use crate::log::{RecordWriter, create};
use gyro_model::{
    Axis,
    estimator::{Estimate, flags},
    words::labels,
};
use std::path::Path;

const COLUMNS: [&str; 5] = ["rate", "rate_filtered", "rate_std", "angle", "angle_fused"];

/// The names of all columns for these axes.
#[must_use]
pub fn header(axes: &[Axis]) -> Vec<String> {
    let of_axes = axes.iter().flat_map(|axis| COLUMNS.iter().map(move |name| format!("{name}_{axis}")));
    std::iter::once("t".to_owned()).chain(of_axes).collect()
}

/// The values below them, but the time.
pub fn values(estimate: &Estimate, axes: &[Axis]) -> impl Iterator<Item = f64> {
    axes.iter().flat_map(|axis| {
        let e = &estimate.axes[axis.index()];
        [e.measured(), e.rate_filtered, e.rate_std, e.angle, e.angle_fused]
    })
}

/// Rows that have no reading of an axis, and so no compensated rate.
#[derive(Clone, Debug, Default)]
pub struct Unmeasured([Option<(u64, i64)>; 3]);

impl Unmeasured {
    /// One more row, of this time, ns.
    pub fn take(&mut self, t_ns: i64, estimate: &Estimate, axes: &[Axis]) {
        for axis in axes.iter().filter(|axis| estimate.axes[axis.index()].flags & flags::HELD != 0) {
            self.0[axis.index()].get_or_insert((0, t_ns)).0 += 1;
        }
    }

    /// What is said of them, an axis a line.
    pub fn says(&self) -> impl Iterator<Item = String> {
        let of =
            |axis: Axis| self.0[axis.index()].map(|(rows, first)| labels::unmeasured(axis, rows, 1e-9 * first as f64));
        Axis::ALL.into_iter().filter_map(of)
    }
}

/// Estimates on their way into a CSV file, which is in its place only when finished.
pub struct EstimateWriter {
    writer: RecordWriter,
    axes: Vec<Axis>,
    start_ns: i128,
    values: Vec<f64>,
}

impl EstimateWriter {
    /// Begins a file for these axes; `start_ns` is the source's own time of its first row.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(path: &Path, axes: &[Axis], start_ns: i128) -> anyhow::Result<Self> {
        let writer = create(path, &header(axes))?;
        Ok(Self { writer, axes: axes.to_vec(), start_ns, values: Vec::new() })
    }

    /// Writes the estimate of the row taken at `t_ns` after the source's first row.
    ///
    /// # Errors
    /// The disk is full.
    pub fn row(&mut self, t_ns: i64, estimate: &Estimate) -> anyhow::Result<()> {
        self.values.clear();
        self.values.extend(values(estimate, &self.axes));
        self.writer.row(self.start_ns + i128::from(t_ns), &self.values)
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(self) -> anyhow::Result<()> {
        self.writer.finish()
    }
}
