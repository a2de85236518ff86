//! The writing of a recording.

use super::{ESTIMATE, SAMPLE, sample_columns, schema::Schema};
use crate::output::{self, Output};
use anyhow::{Context, Result};
use gyro_model::{Axis, Row, estimator::Estimate};
use mcap::{Compression, WriteOptions, Writer, records::MessageHeader, write::NoSeek};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

/// A recording under way; in its place only when finished.
pub struct RecordingWriter {
    writer: Writer<NoSeek<Output>>,
    path: PathBuf,
    start_ns: i128,
    samples: Channel,
    estimates: Channel,
    gyros: Vec<Axis>,
    axes: Vec<Axis>,
    free: usize,
    values: Vec<f64>,
}

/// One channel, and the bytes of the message under way.
struct Channel {
    id: u16,
    sequence: u32,
    schema: Schema,
    message: Vec<u8>,
}

/// What an estimate says of an axis beside the columns of `apply`.
const OF_AXIS: [&str; 8] = ["rate", "rate_filtered", "rate_std", "angle", "angle_fused", "nis", "innovation", "flags"];

/// How messages are packed. The packer is C, which WebAssembly goes without.
const PACKED: Option<Compression> = {
    #[cfg(not(target_family = "wasm"))]
    let packed = Some(Compression::Lz4);
    #[cfg(target_family = "wasm")]
    let packed = None;
    packed
};

impl RecordingWriter {
    /// Begins a recording of a source with these gyros and free channels; `axes` are those that are estimated,
    /// `start_ns` the source's own time of its first row.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(path: &Path, gyros: &[Axis], free_names: &[String], axes: &[Axis], start_ns: i128) -> Result<Self> {
        let output = Output::create(path)?;
        let options = WriteOptions::new()
            .library(concat!("truerate ", env!("CARGO_PKG_VERSION")))
            .compression(PACKED)
            .disable_seeking(true);
        let begin = || -> Result<Self> {
            let mut writer = options.create(NoSeek::new(output))?;
            let estimated = axes.iter().flat_map(|a| OF_AXIS.iter().map(move |name| format!("{name}_{a}")));
            let estimated: Vec<String> = estimated.chain(std::iter::once("epoch".to_owned())).collect();
            let samples = Channel::new(&mut writer, SAMPLE, &sample_columns(gyros, free_names))?;
            let estimates = Channel::new(&mut writer, ESTIMATE, &estimated)?;
            Ok(Self {
                writer,
                path: path.to_owned(),
                start_ns,
                samples,
                estimates,
                gyros: gyros.to_vec(),
                axes: axes.to_vec(),
                free: free_names.len(),
                values: Vec::new(),
            })
        };
        begin().with_context(|| output::failed(path))
    }

    /// Writes one row of the source.
    ///
    /// # Errors
    /// The disk is full.
    pub fn sample(&mut self, row: &Row) -> Result<()> {
        self.values.clear();
        self.values.extend(self.gyros.iter().map(|a| row.gyro[a.index()]));
        self.values.extend(row.ref_angle.iter().chain(&row.ref_rate).chain(&row.accel).chain(&row.ref_quaternion));
        self.values.extend([row.temperature, row.supply]);
        self.values.extend(row.free.iter().take(self.free));
        let time = self.start_ns + i128::from(row.t_ns);
        self.samples.write(&mut self.writer, time, &self.values).with_context(|| output::failed(&self.path))
    }

    /// Writes one estimate, at its time of validity.
    ///
    /// # Errors
    /// The disk is full.
    pub fn estimate(&mut self, estimate: &Estimate) -> Result<()> {
        self.values.clear();
        for axis in &self.axes {
            let e = &estimate.axes[axis.index()];
            let flags = f64::from(e.flags);
            self.values.extend([
                e.measured(),
                e.rate_filtered,
                e.rate_std,
                e.angle,
                e.angle_fused,
                e.nis,
                e.innovation,
                flags,
            ]);
        }
        self.values.push(estimate.epoch as f64);
        let time = self.start_ns + i128::from(estimate.valid_t_ns);
        self.estimates.write(&mut self.writer, time, &self.values).with_context(|| output::failed(&self.path))
    }

    /// Writes index and summary, and puts the file in its place.
    ///
    /// # Errors
    /// The disk is full.
    pub fn finish(mut self) -> Result<()> {
        self.writer.finish().with_context(|| output::failed(&self.path))?;
        self.writer.into_inner().into_inner().finish()
    }
}

impl Channel {
    fn new(writer: &mut Writer<NoSeek<Output>>, topic: &str, columns: &[String]) -> Result<Self> {
        let schema = Schema::new(topic, columns)?;
        let id = writer.add_schema(schema.name(), "protobuf", &schema.encoded())?;
        let id = writer.add_channel(id, topic, "protobuf", &BTreeMap::new())?;
        Ok(Self { id, sequence: 0, schema, message: Vec::new() })
    }

    fn write(&mut self, writer: &mut Writer<NoSeek<Output>>, time_ns: i128, values: &[f64]) -> Result<()> {
        let time = i64::try_from(time_ns).with_context(|| {
            format!("{time_ns} ns is later than MCAP can say: record as CSV, or give the log a clock that starts later")
        })?;
        self.message.clear();
        self.schema.encode(time, values, &mut self.message)?;
        // Viewers have no time before 1970.
        let shown = u64::try_from(time.max(0))?;
        let header =
            MessageHeader { channel_id: self.id, sequence: self.sequence, log_time: shown, publish_time: shown };
        self.sequence = self.sequence.wrapping_add(1);
        writer.write_to_known_channel(&header, &self.message)?;
        Ok(())
    }
}
