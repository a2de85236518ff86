//! Parameter files of autopilots, which know an offset for each axis and a polynomial of the temperature, and no scale factor of a gyro.
//!
//! - ArduPilot (`AP_InertialSensor`, `AP_InertialSensor_tempcal.cpp`): rate = reading − P(T) + P(`CALTEMP`) − `INS_GYROFFS`, with
//!   P(T) = 10⁻⁶ (`GYR1` d + `GYR2` d² + `GYR3` d³), d = T − 35 °C, T held within `TMIN` … `TMAX`.
//! - PX4 (`src/lib/sensor_calibration`, `temperature_compensation`): rate = reading − (`X0` + `X1` d + `X2` d² + `X3` d³) − `CAL_GYROn_XOFF`,
//!   d = T − `TREF`, T held within `TMIN` … `TMAX`.
//! - INAV (`sensors/gyro.c`): rate = (counts − `gyro_zero`) / 16.4, whole counts of a range of ±2000 °/s, in the axes of the chip.

use super::{Exported, Options, comments, linear::Linear};
use crate::model_file::ModelFile;
use gyro_model::Axis;
use std::fmt::Write;

/// The temperature that ArduPilot's polynomials count from, °C.
const ARDUPILOT_REFERENCE: f64 = 35.0;
/// Their coefficients are written a million times too large.
const ARDUPILOT_FACTOR: f64 = 1e6;
/// A scale factor or a coupling that nobody needs to be told of.
const SLIGHT: f64 = 1e-4;

pub fn ardupilot(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    let linear = Linear::of(file);
    let mut warnings = cannot(&linear, "ArduPilot");
    let range = range(file, &linear, &mut warnings);
    let mut text = head(
        "#",
        heading,
        &warnings,
        &[
            "Axes: those of the autopilot, x forward, y right, z down, after INS_GYR's own rotation and before AHRS_ORIENTATION. Fit the model on \
         readings in these axes.",
            "INS_GYR_CAL = 0 keeps ArduPilot from replacing the offsets at every start.",
        ],
    );
    let n = options.sensor;
    let offset = if n == 1 { "INS_GYROFFS".to_owned() } else { format!("INS_GYR{n}OFFS") };
    let middle = range.map_or(25.0, |(low, high)| 0.5 * (low + high));
    let mut set = |name: String, value: f64| {
        let _ = writeln!(text, "{name},{}", short(value));
    };
    set("INS_GYR_CAL".into(), 0.0);
    for &axis in &linear.axes {
        set(format!("{offset}_{}", upper(axis)), linear.at_rest(axis.index(), middle));
    }
    if let Some((low, high)) = range {
        set(format!("INS_GYR{n}_CALTEMP"), middle);
        set(format!("INS_TCAL{n}_ENABLE"), 1.0);
        set(format!("INS_TCAL{n}_TMIN"), low);
        set(format!("INS_TCAL{n}_TMAX"), high);
        for &axis in &linear.axes {
            let coefficients = linear.about(axis.index(), ARDUPILOT_REFERENCE);
            for (k, c) in coefficients.iter().enumerate().skip(1) {
                set(format!("INS_TCAL{n}_GYR{k}_{}", upper(axis)), c * ARDUPILOT_FACTOR);
            }
        }
    }
    Exported { text, warnings }
}

pub fn px4(file: &ModelFile, heading: &str, options: &Options) -> Exported {
    const FLOAT: u8 = 9;
    const INTEGER: u8 = 6;
    let linear = Linear::of(file);
    let mut warnings = cannot(&linear, "PX4");
    let range = range(file, &linear, &mut warnings);
    let n = options.sensor - 1;
    let id = format!(
        "CAL_GYRO{n}_ID (with a temperature polynomial TC_G{n}_ID too) has to be the id of this sensor, or PX4 passes over the rest: it \
         is among the vehicle's own parameters."
    );
    let mut text = head(
        "#",
        heading,
        &warnings,
        &[
            "Axes: those of the airframe, x forward, y right, z down. Fit the model on readings in these axes.",
            &id,
            "Load with QGroundControl: Vehicle Setup, Parameters, Tools, Load from file.",
            "",
            "Vehicle-Id Component-Id Name Value Type",
        ],
    );
    let mut set = |name: String, value: f64, kind: u8| {
        let _ = writeln!(text, "1\t1\t{name}\t{}\t{kind}", short(value));
    };
    let middle = range.map_or(25.0, |(low, high)| 0.5 * (low + high));
    for &axis in &linear.axes {
        set(format!("CAL_GYRO{n}_{}OFF", upper(axis)), linear.at_rest(axis.index(), middle), FLOAT);
    }
    if let Some((low, high)) = range {
        set("TC_G_ENABLE".into(), 1.0, INTEGER);
        set(format!("TC_G{n}_TMIN"), low, FLOAT);
        set(format!("TC_G{n}_TMAX"), high, FLOAT);
        set(format!("TC_G{n}_TREF"), middle, FLOAT);
        for &axis in &linear.axes {
            let i = axis.index();
            set(format!("TC_G{n}_X0_{i}"), 0.0, FLOAT);
            for (k, c) in linear.about(i, middle).iter().enumerate().skip(1) {
                set(format!("TC_G{n}_X{k}_{i}"), *c, FLOAT);
            }
        }
    }
    Exported { text, warnings }
}

/// Steps of the gyro's word for one °/s, where the range is ±2000 °/s.
const INAV_COUNTS: f64 = 16.4;

pub fn inav(file: &ModelFile, heading: &str) -> Exported {
    let linear = Linear::of(file);
    let mut warnings = cannot(&linear, "INAV");
    if linear.goes_by_temperature() {
        warnings.push(
            "INAV has no temperature of a gyro: the offset is that of the middle of the temperatures of the fit".into(),
        );
    }
    let range = file.provenance.as_ref().and_then(|p| p.temperature);
    let middle = range.map_or(25.0, |(low, high)| 0.5 * (low + high));
    let mut text = head(
        "#",
        heading,
        &warnings,
        &[
            "Axes: those of the chip, before INAV's alignment. Fit the model on raw counts in these axes: --map gyro_x_dps=gx/16.4",
            "Paste into the CLI, then `save`. init_gyro_cal = OFF keeps INAV from measuring the zero again at every start.",
        ],
    );
    text.push_str("set init_gyro_cal = OFF\n");
    for &axis in &linear.axes {
        let counts = (linear.at_rest(axis.index(), middle).to_degrees() * INAV_COUNTS).round();
        let _ = writeln!(text, "set gyro_zero_{axis} = {}", if counts == 0.0 { 0.0 } else { counts });
    }
    Exported { text, warnings }
}

/// The temperatures over which a polynomial holds, where there is one.
fn range(file: &ModelFile, linear: &Linear, warnings: &mut Vec<String>) -> Option<(f64, f64)> {
    if !linear.goes_by_temperature() {
        return None;
    }
    let range = file.provenance.as_ref().and_then(|p| p.temperature);
    if range.is_none() {
        warnings.push(
            "the model does not say at which temperatures it was fitted: the offsets are those of 25 °C, and the temperature is left out"
                .into(),
        );
    }
    range
}

/// What an autopilot cannot hold: effects, scale factors, couplings, in words with what each leaves.
pub(super) fn cannot(linear: &Linear, autopilot: &str) -> Vec<String> {
    let mut says = linear.warnings(autopilot);
    for &axis in &linear.axes {
        let i = axis.index();
        let scale = linear.matrix[(i, i)];
        if (scale - 1.0).abs() > SLIGHT {
            says.push(format!(
                "axis {axis}: {autopilot} has no scale factor of a gyro: the rate stays {:.2} % too {}, {:.2} °/s at 100 °/s",
                100.0 * (1.0 / scale - 1.0).abs(),
                if scale > 1.0 { "low" } else { "high" },
                100.0 * (1.0 / scale - 1.0).abs()
            ));
        }
        for other in Axis::ALL.into_iter().filter(|other| *other != axis) {
            let share = linear.matrix[(i, other.index())];
            if share.abs() > SLIGHT {
                says.push(format!(
                    "axis {axis}: {autopilot} has no coupling of the axes: turning about {other} at 100 °/s leaves {:.2} °/s here",
                    100.0 * share.abs()
                ));
            }
        }
    }
    let missing: Vec<&str> = Axis::ALL.into_iter().filter(|a| !linear.axes.contains(a)).map(Axis::letter).collect();
    if !missing.is_empty() {
        says.push(format!(
            "the model says nothing of axis {}: the parameters there are left as they are",
            missing.join(", ")
        ));
    }
    says
}

pub(super) fn head(mark: &str, heading: &str, warnings: &[String], notes: &[&str]) -> String {
    let held = warnings.iter().map(|says| format!("NOT HELD: {says}."));
    comments(mark, [format!("{heading}.")].into_iter().chain(notes.iter().map(|&n| n.to_owned())).chain(held))
}

fn upper(axis: Axis) -> String {
    axis.letter().to_uppercase()
}

/// What a single-precision parameter keeps, as a plain decimal.
fn short(value: f64) -> String {
    let single = value as f32;
    if single == 0.0 { "0".into() } else { format!("{single}") }
}
