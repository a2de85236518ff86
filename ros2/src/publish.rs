//! The compensated rate out, as `sensor_msgs/msg/Imu`.

use crate::{
    imu::{ROW, Reading},
    keys::{self, IMU},
    session::{self, Reach},
    wall_ns,
};
use anyhow::{Context, Result, anyhow};
use std::{
    hash::{BuildHasher, RandomState},
    io::Read,
    os::unix::net::UnixStream,
    thread::sleep,
    time::Duration,
};
use zenoh::Wait;

/// What `truerate-ros2 publish` takes.
#[derive(clap::Args, Debug, Clone)]
pub struct Args {
    #[command(flatten)]
    reach: Reach,
    /// Where `truerate run --out unix:PATH` gives the rate
    #[arg(long, value_name = "unix:PATH")]
    from: String,
    /// The topic to send to
    #[arg(long, value_name = "TOPIC", default_value = "/imu/compensated")]
    topic: String,
    /// The frame of the messages
    #[arg(long, value_name = "FRAME", default_value = "imu_link")]
    frame: String,
}

/// Between two tries to find the pipeline.
const AGAIN: Duration = Duration::from_millis(100);

/// Sends until it is ended; a pipeline that ends is waited for again.
pub fn run(args: &Args) -> Result<()> {
    let path = args.from.strip_prefix("unix:").with_context(|| format!("--from {}: say unix:PATH", args.from))?;
    let session = session::open(&args.reach)?;
    let failed = |error: zenoh::Error| anyhow!("{}: {error}", args.topic);
    let (domain, id) = (args.reach.domain, session.zid().to_string());
    let publisher = session.declare_publisher(keys::topic(domain, &args.topic, &IMU)).wait().map_err(failed)?;
    let tokens = [keys::node_token(domain, &id), keys::publisher_token(domain, &id, &args.topic, &IMU)];
    let _tokens = tokens
        .into_iter()
        .map(|token| session.liveliness().declare_token(token).wait())
        .collect::<Result<Vec<_>, _>>()
        .map_err(failed)?;
    let sender: [u8; 16] = {
        let halves = [0, 1].map(|half| RandomState::new().hash_one((&id, half)).to_le_bytes());
        std::array::from_fn(|k| halves[k / 8][k % 8])
    };
    let (mut number, mut told) = (0, false);
    loop {
        let Ok(mut rows) = UnixStream::connect(path) else {
            if !std::mem::replace(&mut told, true) {
                eprintln!("truerate-ros2: {path}: no pipeline gives a rate there yet");
            }
            sleep(AGAIN);
            continue;
        };
        told = false;
        let mut row = [0; ROW];
        while rows.read_exact(&mut row).is_ok() {
            let Some(reading) = Reading::from_row(&row) else { continue };
            number += 1;
            let sent_ns = wall_ns()?;
            let stamp_ns = sent_ns.saturating_sub(clock_ns().saturating_sub(reading.valid_clock_ns));
            publisher
                .put(reading.to_cdr(stamp_ns, &args.frame))
                .attachment(keys::attachment(number, sent_ns as i64, sender))
                .wait()
                .map_err(failed)?;
        }
        sleep(AGAIN);
    }
}

/// `CLOCK_MONOTONIC`, ns: the clock of a row's time.
fn clock_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}
