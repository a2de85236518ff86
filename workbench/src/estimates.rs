//! The columns of `truerate apply` and of `run --record`: the same rows, byte for byte.

use crate::log::{RecordWriter, create};
use gyro_model::{Axis, estimator::Estimate};
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
        [e.rate, e.rate_filtered, e.rate_std, e.angle, e.angle_fused]
    })
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
