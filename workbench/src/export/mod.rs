//! A model in the form in which other programs use it: a C header, parameters of autopilots, noise for estimators.
//!
//! What a target cannot hold is said twice: as a comment in what is written, and as a warning.

mod autopilot;
mod c;
mod linear;
mod noise;
mod registers;
mod robot;
mod single;

pub use registers::Chip;

use crate::{
    files,
    model_file::{self, ModelFile},
    words::{Task, call},
};
use anyhow::{Context, Result, bail};
use gyro_model::effects::user;
use std::{path::Path, str::FromStr};

/// Where a model is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Target {
    /// A C99 header with a function that compensates a reading
    C,
    /// The same header in single precision (float), for a processor without doubles
    CFloat,
    /// Kalibr's imu.yaml: noise densities, and the matrices of its model scale-misalignment
    Kalibr,
    /// ROS 2 parameters: covariance for the IMU broadcaster of ros2_control, and the calibration
    Ros,
    /// ArduPilot parameters: INS_GYROFFS_*, INS_TCAL*
    Ardupilot,
    /// PX4 parameters in QGroundControl's format: CAL_GYRO*, TC_G*
    Px4,
    /// Autoware's imu_corrector: offsets and standard deviations
    Autoware,
    /// OpenVINS' kalibr_imu_chain.yaml: noise, matrix and rotation
    Openvins,
    /// VINS-Mono and VINS-Fusion: gyr_n and gyr_w, for one reading at --rate
    Vins,
    /// INAV settings: gyro_zero_*, in counts
    Inav,
    /// Registers of the chip that hold the zero of its gyro: --chip
    Registers,
    /// The model file's own keys as JSON
    Json,
}

impl FromStr for Target {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> Result<Self> {
        Ok(match name {
            "c" => Self::C,
            "c-float" => Self::CFloat,
            "registers" => Self::Registers,
            "kalibr" => Self::Kalibr,
            "ros" => Self::Ros,
            "ardupilot" => Self::Ardupilot,
            "px4" => Self::Px4,
            "autoware" => Self::Autoware,
            "openvins" => Self::Openvins,
            "vins" => Self::Vins,
            "inav" => Self::Inav,
            "json" => Self::Json,
            _ => bail!(
                "format '{name}': expected c, c-float, kalibr, ros, ardupilot, px4, autoware, openvins, vins, inav, registers or json"
            ),
        })
    }
}

/// What a target needs besides the model.
#[derive(Clone, Debug)]
pub struct Options {
    /// Samples of the gyro a second, Hz.
    pub rate: Option<f64>,
    /// The topic of its messages.
    pub topic: String,
    /// Which of an autopilot's gyros it is, 1 the first.
    pub sensor: u8,
    /// The log's own columns that the model's expressions go by, in its order ([`load`]).
    pub channels: Vec<String>,
    /// The chip whose registers are written.
    pub chip: Option<Chip>,
}

/// What is written, and what it cannot hold.
#[derive(Clone, Debug, Default)]
pub struct Exported {
    /// The text of the file.
    pub text: String,
    /// One sentence each.
    pub warnings: Vec<String>,
}

/// Writes a model out for a target; `name` is how the model was named.
///
/// # Errors
/// A model that no number can be taken from, or without an axis.
pub fn export(file: &ModelFile, name: &str, target: Target, options: &Options) -> Result<Exported> {
    model_file::refuse_unseen(&file.model)?;
    if file.model.axes.iter().all(Option::is_none) {
        bail!("model {name}: has no axis: fit one with {}", call(Task::Fit, &format!("LOG -o {name}")));
    }
    let heading = heading(file, name);
    Ok(match target {
        Target::C => c::header(file, &heading, &options.channels),
        Target::CFloat => c::in_floats(&c::header(file, &heading, &options.channels)),
        Target::Kalibr => noise::kalibr(file, &heading, options),
        Target::Ros => noise::ros(file, &heading, options),
        Target::Ardupilot => autopilot::ardupilot(file, &heading, options),
        Target::Px4 => autopilot::px4(file, &heading, options),
        Target::Autoware => robot::autoware(file, &heading, options),
        Target::Openvins => robot::openvins(file, &heading, options),
        Target::Vins => robot::vins(file, &heading, options),
        Target::Inav => autopilot::inav(file, &heading),
        Target::Registers => {
            let chip = options.chip.context(
                "whose registers? say the chip: mpu6050, mpu9250, icm426xx, bmi160, bmi270 (--chip, or chip= in Python)",
            )?;
            registers::registers(file, &heading, chip)?
        }
        Target::Json => Exported { text: json(file)?, warnings: Vec::new() },
    })
}

/// Reads a model without a log: whatever an expression of the user's calls by name and no signal is called is taken for a channel.
/// Their names, in the order in which the model counts them.
///
/// # Errors
/// As [`model_file::load`].
pub fn load(path: &Path) -> Result<(ModelFile, Vec<String>)> {
    let names = files::read_to_string(path).map(|text| channels(&text)).unwrap_or_default();
    Ok((model_file::load(path, &names)?, names))
}

fn channels(text: &str) -> Vec<String> {
    let table: toml::Table = toml::from_str(text).unwrap_or_default();
    let own = table.get("effect").and_then(toml::Value::as_table).into_iter().flatten();
    let mut names: Vec<String> = Vec::new();
    for (_, section) in own {
        let parameters = section.get("parameters").and_then(toml::Value::as_table);
        let parameters: Vec<String> = parameters.into_iter().flat_map(|p| p.keys().cloned()).collect();
        let regressor = section.get("regressor").and_then(toml::Value::as_str).unwrap_or_default();
        for channel in user::channels(regressor, &parameters) {
            if !names.contains(&channel) {
                names.push(channel);
            }
        }
    }
    names
}

/// The keys of the model file, as JSON.
fn json(file: &ModelFile) -> Result<String> {
    let table: toml::Table = toml::from_str(&model_file::render(file)).context("the model as TOML")?;
    let mut text = serde_json::to_string_pretty(&plain(&toml::Value::Table(table)))?;
    text.push('\n');
    Ok(text)
}

/// TOML's own way to serialise a date is a table: as text it is what a reader of JSON expects.
fn plain(value: &toml::Value) -> serde_json::Value {
    match value {
        toml::Value::String(text) => text.as_str().into(),
        toml::Value::Integer(number) => (*number).into(),
        toml::Value::Float(number) => (*number).into(),
        toml::Value::Boolean(flag) => (*flag).into(),
        toml::Value::Datetime(moment) => moment.to_string().into(),
        toml::Value::Array(values) => values.iter().map(plain).collect(),
        toml::Value::Table(table) => table.iter().map(|(key, value)| (key.clone(), plain(value))).collect(),
    }
}

/// `model m.toml, epoch 3, fitted 2026-11-20T12:00:00Z on yaw.csv.gz`, fit for any comment.
fn heading(file: &ModelFile, name: &str) -> String {
    let from = file.provenance.as_ref();
    let fitted = from.and_then(|p| p.fitted).map(|at| format!(", fitted {}", at.strftime("%Y-%m-%dT%H:%M:%SZ")));
    let log = from.and_then(|p| p.log.as_ref()).map(|log| format!(" on {log}"));
    let text = format!(
        "Written by truerate {} from model {name}, epoch {}{}{}",
        env!("CARGO_PKG_VERSION"),
        file.model.epoch,
        fitted.unwrap_or_default(),
        log.unwrap_or_default()
    );
    text.replace(|c: char| c.is_control(), " ").replace("*/", "* /")
}

/// Lines as comments.
fn comments(mark: &str, lines: impl IntoIterator<Item = String>) -> String {
    lines
        .into_iter()
        .map(|line| if line.is_empty() { format!("{mark}\n") } else { format!("{mark} {line}\n") })
        .collect()
}
