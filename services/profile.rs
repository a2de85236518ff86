//! When every sample was at every stage, as a trace in Chrome's JSON, which Perfetto shows: written from the stamps that each
//! estimate carries, by a thread of the supervisor that looks now and then, so that nobody waits for it or wakes it.

use crate::stop::Stop;
use anyhow::{Context, anyhow};
use ipc_types::{Estimate, MARK_DATA, domain::Domain, port::Hub, topic, wait::Wait};
use std::{
    fmt,
    fs::{File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    thread::{self, JoinHandle},
    time::Duration,
};

/// Between two looks: at 8 kHz a few samples, of the thousands that there is room for.
const LOOK: Duration = Duration::from_millis(2);

/// The thread that writes.
#[derive(Debug)]
pub struct Profiler {
    stop: Stop,
    thread: Option<JoinHandle<anyhow::Result<Trace>>>,
}

impl Profiler {
    /// Begins the trace at `path`, or goes on with it.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn start(domain: &Domain, run: u64, path: &Path, goes_on: bool) -> anyhow::Result<Self> {
        let file = OpenOptions::new().write(true).create(true).truncate(!goes_on).append(goes_on).open(path);
        let mut trace = Trace::of(file.with_context(|| path.display().to_string())?, path.to_owned());
        if !goes_on {
            trace.begin().with_context(|| path.display().to_string())?;
        }
        let (stop, domain) = (Stop::default(), domain.clone());
        let asked = stop.clone();
        let thread = thread::Builder::new()
            .name("profiler".to_owned())
            .spawn(move || {
                let path = trace.path.clone();
                follow(&domain, run, trace, &asked).with_context(|| path.display().to_string())
            })
            .context("the profiler's thread")?;
        Ok(Self { stop, thread: Some(thread) })
    }

    /// Ends it when everything that was given is written.
    ///
    /// # Errors
    /// Where the file could not be written to its end.
    pub fn end(mut self) -> anyhow::Result<()> {
        match self.join()? {
            Some(mut trace) => trace.end().with_context(|| trace.path.display().to_string()),
            None => Ok(()),
        }
    }

    fn join(&mut self) -> anyhow::Result<Option<Trace>> {
        self.stop.ask();
        let Some(thread) = self.thread.take() else { return Ok(None) };
        thread.join().unwrap_or_else(|_| Err(anyhow!("its thread died"))).map(Some)
    }
}

impl Drop for Profiler {
    fn drop(&mut self) {
        if let Err(error) = self.join() {
            tracing::error!("the trace is not whole: {error:#}");
        }
    }
}

fn follow(domain: &Domain, run: u64, mut trace: Trace, stop: &Stop) -> anyhow::Result<Trace> {
    let hub = Hub::join(domain, "profiler")?;
    // It looks now and then and sleeps on no doorbell: nobody has to wake it.
    let estimates = hub.reader(&topic::ESTIMATE, None, Wait::Spin)?;
    loop {
        let last = stop.asked();
        while let Some(estimate) = estimates.take()? {
            if estimate.run == run && estimate.mark == MARK_DATA {
                trace.write(&estimate)?;
            }
        }
        if last {
            trace.out.flush()?;
            return Ok(trace);
        }
        thread::sleep(LOOK);
    }
}

/// The file. Who shows it wants no end mark, so what was written is of use whenever it stops.
#[derive(Debug)]
struct Trace {
    out: BufWriter<File>,
    path: PathBuf,
    sequence: u64,
    epoch: Option<u64>,
    /// When acquisition gave the sample before, ns: slices of one track do not overlap.
    gave_ns: u64,
}

/// Tracks of the trace.
const ACQUISITION: u32 = 1;
const KALMAN: u32 = 2;

impl Trace {
    fn of(file: File, path: PathBuf) -> Self {
        Self { out: BufWriter::new(file), path, sequence: 0, epoch: None, gave_ns: 0 }
    }

    fn begin(&mut self) -> io::Result<()> {
        write!(self.out, "[{{\"name\":\"process_name\",\"ph\":\"M\",\"pid\":1,\"args\":{{\"name\":\"truerate\"}}}}")?;
        for (track, name) in [(ACQUISITION, "acquisition"), (KALMAN, "kalman")] {
            self.event(format_args!(r#""name":"thread_name","ph":"M","tid":{track},"args":{{"name":"{name}"}}"#))?;
        }
        self.out.flush()
    }

    fn event(&mut self, fields: fmt::Arguments<'_>) -> io::Result<()> {
        write!(self.out, ",\n{{\"pid\":1,{fields}}}")
    }

    /// One sample: a slice at acquisition, an arrow, a slice at kalman, and how long it took in all.
    fn write(&mut self, e: &Estimate) -> io::Result<()> {
        let (n, gave, took) = (e.sequence, us(e.acquisition_gave_ns), us(e.kalman_took_ns));
        if self.sequence > 0 && n > self.sequence + 1 {
            let args = format!(r#""args":{{"from":{},"to":{}}}"#, self.sequence + 1, n - 1);
            self.event(format_args!(r#""name":"lost","ph":"i","s":"p","ts":{took},"tid":{KALMAN},{args}"#))?;
        }
        if self.epoch.replace(e.epoch) != Some(e.epoch) {
            let name = format!("parameters of epoch {}", e.epoch);
            self.event(format_args!(r#""name":"{name}","ph":"i","s":"p","ts":{took},"tid":{KALMAN}"#))?;
        }
        let begun_ns = e.arrived_ns.max(self.gave_ns).min(e.acquisition_gave_ns);
        let (begun, long) = (us(begun_ns), us(e.acquisition_gave_ns - begun_ns));
        let [waited, filtered, all] = [
            (e.acquisition_gave_ns, e.kalman_took_ns),
            (e.kalman_took_ns, e.kalman_gave_ns),
            (e.arrived_ns, e.kalman_gave_ns),
        ]
        .map(|(from, to)| us(to.saturating_sub(from)));
        let on = |track| format!(r#""tid":{track},"args":{{"sample":{n}}}"#);
        let (first, second) = (on(ACQUISITION), on(KALMAN));
        self.event(format_args!(r#""name":"acquisition","ph":"X","ts":{begun},"dur":{long},{first}"#))?;
        self.event(format_args!(r#""name":"hop","cat":"hop","ph":"s","id":{n},"ts":{begun},{first}"#))?;
        self.event(format_args!(r#""name":"kalman","ph":"X","ts":{took},"dur":{filtered},{second}"#))?;
        self.event(format_args!(r#""name":"hop","cat":"hop","ph":"f","bp":"e","id":{n},"ts":{took},{second}"#))?;
        let args = format!(r#""args":{{"all":{all},"hop":{waited},"kalman":{filtered}}}"#);
        self.event(format_args!(r#""name":"sample to estimate (µs)","ph":"C","ts":{gave},{args}"#))?;
        (self.sequence, self.gave_ns) = (n, e.acquisition_gave_ns);
        Ok(())
    }

    /// Without this it is read all the same.
    fn end(&mut self) -> io::Result<()> {
        writeln!(self.out, "\n]")?;
        self.out.flush()
    }
}

/// A time as the format has it: µs, to the ns.
fn us(ns: u64) -> String {
    format!("{}.{:03}", ns / 1000, ns % 1000)
}
