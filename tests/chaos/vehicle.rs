//! A vehicle that swings slowly: its sensor sends rows by UDP at 1 kHz, its control loop, in C, takes every rate.

use crate::{fault::Swing, harness::Place};
use std::{
    io::{BufRead, BufReader},
    net::UdpSocket,
    path::Path,
    process::{Child, Command, Stdio},
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::Duration,
};
use truerate::clock::now_ns;

const STEP_NS: u64 = 1_000_000;

/// Sends what a gyro with a bias and a scale factor error reads, and an angle without error.
pub struct Sensor {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<u64>>,
}

impl Sensor {
    pub fn start(to: String, swing: Swing) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let thread = std::thread::spawn(move || {
            let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
            let (mut due, mut sent) = (now_ns(), 0);
            while !stopped.load(Ordering::Relaxed) {
                let now = now_ns();
                if now < due {
                    std::thread::sleep(Duration::from_nanos(due - now));
                    continue;
                }
                // Some noise, the same at every run: the digits of a multiple of the golden ratio.
                let noise = 0.004 * ((sent as f64 * 0.618_033_988_75).fract() - 0.5);
                let gyro = 1.02 * swing.rate(due) + 0.02 + noise;
                let row =
                    format!("{}.{:09},{gyro:.9},{:.9}\n", due / 1_000_000_000, due % 1_000_000_000, swing.angle(due));
                // Nobody listens while acquisition is dead.
                let _ = socket.send_to(row.as_bytes(), &to);
                sent += 1;
                due += STEP_NS;
            }
            sent
        });
        Self { stop, thread: Some(thread) }
    }

    /// Ends it; how many rows it sent.
    pub fn end(mut self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap()
    }
}

/// A row as the control loop had it; times in ns of `CLOCK_MONOTONIC`.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    pub number: u64,
    pub sequence: u64,
    pub valid_ns: u64,
    pub given_ns: u64,
    pub epoch: u64,
    pub rate: f64,
    pub std: f64,
}

/// The control loop: a C program on `clients/c/truerate.h`.
pub struct Control {
    child: Child,
    rows: Arc<Mutex<Vec<Taken>>>,
    reader: Option<JoinHandle<()>>,
}

impl Control {
    /// `None`, said aloud, where there is no compiler.
    pub fn start(place: &Place, ring: &Path) -> Option<Self> {
        let here = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/chaos/rows.c");
        let include = concat!("-I", env!("CARGO_MANIFEST_DIR"), "/clients/c");
        let program = place.file("rows");
        let strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2", include, "-o"];
        let compiled = match Command::new("cc").args(strict).arg(&program).arg(here).output() {
            Ok(output) => output,
            Err(error) => {
                eprintln!("skipped: there is no C compiler here ({error})");
                return None;
            }
        };
        assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
        let mut child = Command::new(program).arg(ring).stdout(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let rows = Arc::new(Mutex::new(Vec::new()));
        let taken = rows.clone();
        let reader = std::thread::spawn(move || {
            for line in out.lines() {
                let line = line.unwrap();
                let words: Vec<&str> = line.split(' ').collect();
                let whole = |k: usize| words[k].parse::<u64>().unwrap();
                let real = |k: usize| words[k].parse::<f64>().unwrap();
                taken.lock().unwrap().push(Taken {
                    number: whole(1),
                    sequence: whole(2),
                    valid_ns: whole(3),
                    given_ns: whole(4),
                    epoch: whole(5),
                    rate: real(6),
                    std: real(7),
                });
            }
        });
        Some(Self { child, rows, reader: Some(reader) })
    }

    /// The newest row.
    pub fn newest(&self) -> Option<Taken> {
        self.rows.lock().unwrap().last().copied()
    }

    /// Rows that have come since the last time this was asked, but for the newest, which stays.
    pub fn take(&self) -> Vec<Taken> {
        let mut rows = self.rows.lock().unwrap();
        let newest = rows.last().copied();
        let taken = std::mem::take(&mut *rows);
        rows.extend(newest);
        taken
    }

    /// Waits for its end, which the pipeline's is.
    pub fn end(mut self) {
        assert!(self.child.wait().unwrap().success());
        self.reader.take().unwrap().join().unwrap();
    }
}

impl Drop for Control {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
