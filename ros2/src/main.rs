//! `truerate-ros2`: ROS 2 topics in, the compensated rate out, over Zenoh as rmw_zenoh lays it out. No ROS is needed here.

mod imu;
mod keys;
mod listen;
mod publish;
mod session;

use anyhow::Result;
use clap::Parser;
use std::process::ExitCode;

/// ROS 2 topics for truerate, where ROS runs on rmw_zenoh (RMW_IMPLEMENTATION=rmw_zenoh_cpp)
#[derive(Parser)]
#[command(
    version,
    after_long_help = "\
Examples:
  truerate-ros2 listen --imu /imu/data_raw --reference /vicon/robot/pose > log.csv
                                      a log that `truerate diagnose log.csv` reads
  truerate-ros2 listen --imu /imu/data_raw --reference /vicon/robot/pose | truerate run --source - --speed max --out unix:/run/rate
                                      live
  truerate-ros2 publish --from unix:/run/rate --topic /imu/compensated --frame imu_link
                                      the rate, as sensor_msgs/msg/Imu"
)]
enum Command {
    /// Take an IMU and its reference: a line of CSV for every reading
    Listen(listen::Args),
    /// Send the compensated rate as sensor_msgs/msg/Imu
    Publish(publish::Args),
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Listen(args) => listen::run(&args),
        Command::Publish(args) => publish::run(&args),
    };
    done.map_or_else(
        |error: anyhow::Error| {
            eprintln!("truerate-ros2: {error:#}");
            ExitCode::FAILURE
        },
        |()| ExitCode::SUCCESS,
    )
}

/// Seconds since 1970 of this machine's clock, ns.
fn wall_ns() -> Result<u64> {
    Ok(std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH)?.as_nanos() as u64)
}
