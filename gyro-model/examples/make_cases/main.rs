//! The diagnosis benchmark's generator: logs with a known hidden effect, or none, every log another sensor.
//!
//! ```text
//! cargo run -p gyro-model --example make_cases -- FOLDER [--count 36] [--seed 1]
//! ```
//!
//! FOLDER gets `NAME.csv.gz` for each case and one `truth.json`: `{"NAME": {"axis": …, "hidden": {ID: {PARAMETER:
//! VALUE}}, "motion": …, "rate_hz": …}}`. The same seed gives the same cases.

mod choice;

use choice::Case;
use clap::Parser;
use flate2::{Compression, write::GzEncoder};
use gyro_model::{
    Axis,
    simulate::{Scenario, simulate},
};
use std::{
    error::Error,
    fs::{self, File},
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

#[derive(Parser)]
#[command(about = "Writes logs with a known hidden effect, or none")]
struct Arguments {
    /// Where the logs and truth.json go.
    folder: PathBuf,
    /// Logs.
    #[arg(long, default_value_t = 36)]
    count: u64,
    /// Of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments { folder, count, seed } = Arguments::parse();
    fs::create_dir_all(&folder)?;
    let mut truth = serde_json::Map::new();
    for k in 0..count {
        let case = Case::random(choice::seed_of(seed, k));
        let name = format!("case-{seed}-{k:03}");
        write_log(&folder.join(format!("{name}.csv.gz")), &case.scenario)?;
        eprintln!("{name}  {}", case.truth());
        truth.insert(name, case.truth());
    }
    fs::write(folder.join("truth.json"), serde_json::to_string_pretty(&truth)?)?;
    Ok(())
}

fn write_log(path: &Path, scenario: &Scenario) -> Result<(), Box<dyn Error>> {
    let i = scenario.sensor.axis.index();
    let axes = [i, (i + 2) % 3, (i + 1) % 3].map(|k| Axis::ALL[k]);
    let mut log = GzEncoder::new(BufWriter::new(File::create(path)?), Compression::fast());
    let [a, b, c] = axes;
    writeln!(log, "t,gyro_{a},gyro_{b},gyro_{c},ref_angle_{a},accel_x,accel_y,accel_z,temp,supply")?;
    for row in simulate(scenario).record.rows {
        write!(log, "{:.6}", row.t_ns as f64 * 1e-9)?;
        for axis in axes {
            write!(log, ",{:.8}", row.gyro[axis.index()])?;
        }
        match row.ref_angle[i] {
            angle if angle.is_finite() => write!(log, ",{angle:.8}")?,
            _ => write!(log, ",")?,
        }
        let [x, y, z] = row.accel;
        writeln!(log, ",{x:.6},{y:.6},{z:.6},{:.2},{:.6}", row.temperature, row.supply)?;
    }
    log.finish()?.flush()?;
    Ok(())
}
