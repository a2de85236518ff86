//! `truerate export`: the model where it is used.

use crate::commands::{print, subject::writable};
use anyhow::{Context, Result};
use std::{path::PathBuf, process::ExitCode};
use workbench::{
    export::{self, Chip, Options, Target},
    output,
};

/// What `truerate export` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate export model.toml --to c -o gyro_model.h
      a header for firmware: truerate_step() compensates a reading
  truerate export model.toml --to px4 --sensor 1 -o gyro.params
  truerate export model.toml --to ardupilot -o gyro.param
  truerate export model.toml --to kalibr --rate 200 -o imu.yaml
  truerate export model.toml --to ros --rate 200
  truerate export model.toml --to autoware --rate 100 -o imu_corrector.param.yaml
  truerate export model.toml --to openvins --rate 200 -o kalibr_imu_chain.yaml
  truerate export model.toml --to vins --rate 200
      noise of one reading, as VINS-Mono and VINS-Fusion want it
  truerate export model.toml --to inav
  truerate export model.toml --to c-float -o gyro_model.h
      the header in single precision
  truerate export model.toml --to registers --chip bmi270
      the chip's own registers for the zero of its gyro
  truerate export model.toml --to json

If the model needs only + - * /, the header computes the same as `truerate apply` to the last bit.
Anything that a target cannot represent gives a warning here and a comment in the file.")]
pub struct Args {
    /// The model to export
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// Where it is used
    #[arg(long, value_enum, value_name = "TARGET")]
    to: Target,
    /// Message rate of the gyro, Hz, for kalibr, ros, autoware, openvins and vins
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// The topic of the gyro's messages, for kalibr and openvins
    #[arg(long, value_name = "NAME", default_value = "/imu/data_raw")]
    topic: String,
    /// Number of the gyro in the autopilot, from 1, for ardupilot and px4
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=3))]
    sensor: u8,
    /// The chip, for registers
    #[arg(long, value_enum, value_name = "CHIP", required_if_eq("to", "registers"))]
    chip: Option<Chip>,
    /// The file to write; without it, standard output
    #[arg(short, long, value_name = "F", default_value = "-")]
    output: PathBuf,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "expected a number of Hz, such as 200".to_owned())?;
    if rate.is_finite() && rate > 0.0 { Ok(rate) } else { Err("expected more than 0 Hz".to_owned()) }
}

/// Writes the model out, and warns of what that leaves out.
///
/// # Errors
/// A model that cannot be read or used, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    writable(&args.output, &[&args.model])?;
    let (file, channels) = export::load(&args.model)?;
    let options =
        Options { rate: args.rate, topic: args.topic.clone(), sensor: args.sensor, channels, chip: args.chip };
    let exported = export::export(&file, &args.model.display().to_string(), args.to, &options)?;
    for warning in &exported.warnings {
        eprintln!("warning: {warning}");
    }
    if args.output.as_os_str() == "-" {
        print(&exported.text)?;
    } else {
        output::write(&args.output, exported.text.as_bytes()).context("the model is not written out")?;
    }
    Ok(ExitCode::SUCCESS)
}
