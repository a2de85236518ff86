//! A long drive with a hidden effect and a dashboard, measured: memory and processor time of every process, what was
//! lost, how often parameters and diagnoses came. Not run with the other tests:
//!
//! ```console
//! $ cargo test --test pipeline a_long_drive -- --ignored --nocapture
//! ```
//!
//! `TRUERATE_MINUTES` (10), `TRUERATE_RATE` (1000, Hz), `TRUERATE_REFERENCE` (`encoder`; `orientation`: three axes). In
//! the second half a headless Chromium has the dashboard open, where there is one.

use crate::{
    harness::{Pipeline, Place},
    setting,
};
use ipc_types::{
    Diagnosis, Parameters,
    port::{Hub, Reader},
    topic,
    wait::Wait,
};
use std::{
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

const SERVICES: [&str; 4] = ["acquisition", "kalman", "compensator", "dashboard"];

/// Resident memory in MB and processor time in s.
fn measured(pid: u32) -> (f64, f64) {
    let text = |file: &str| fs::read_to_string(format!("/proc/{pid}/{file}")).unwrap();
    let pages: f64 = text("statm").split_whitespace().nth(1).unwrap().parse().unwrap();
    let stat = text("stat");
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    let per_second = rustix::param::clock_ticks_per_second() as f64;
    (pages * rustix::param::page_size() as f64 / 1e6, ticks / per_second)
}

fn all(pipeline: &Pipeline) -> Vec<(f64, f64)> {
    let mut pids: Vec<u32> = SERVICES.iter().map(|service| pipeline.pid(service).unwrap()).collect();
    pids.push(pipeline.child.id());
    pids.into_iter().map(measured).collect()
}

/// What comes on two topics, counted.
struct Counts {
    parameters: Reader<Parameters>,
    diagnoses: Reader<Diagnosis>,
    epochs: u64,
    given: u64,
    last: u64,
    _hub: Hub,
}

impl Counts {
    fn join(pipeline: &Pipeline) -> Self {
        let hub = Hub::join(&pipeline.domain, "onlooker").unwrap();
        let parameters = hub.reader(&topic::PARAMETERS, None, Wait::Event).unwrap();
        let diagnoses = hub.reader(&topic::DIAGNOSIS, None, Wait::Event).unwrap();
        Self { parameters, diagnoses, epochs: 0, given: 0, last: 0, _hub: hub }
    }

    /// Looks on for so long; epochs and diagnoses in that time.
    fn over(&mut self, time: Duration) -> (u64, u64) {
        let (epochs, given) = (self.epochs, self.given);
        let until = Instant::now() + time;
        while Instant::now() < until {
            if let Some(parameters) = self.parameters.newest().unwrap() {
                self.epochs += u64::from(parameters.epoch != self.last);
                self.last = parameters.epoch;
            }
            self.given += u64::from(self.diagnoses.newest().unwrap().is_some());
            sleep(Duration::from_millis(20));
        }
        (self.epochs - epochs, self.given - given)
    }
}

/// A page open in a browser, until dropped.
struct Page(Child);

impl Page {
    fn open(place: &Place, pipeline: &Pipeline) -> Option<Self> {
        let url = fs::read_to_string(pipeline.domain.folder().join("dashboard.url")).unwrap();
        let chromium = std::env::var("CHROMIUM").unwrap_or_else(|_| "/usr/bin/chromium".to_owned());
        let profile = format!("--user-data-dir={}", place.file("profile").display());
        let child = Path::new(&chromium).exists().then(|| {
            Command::new(chromium)
                .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--remote-debugging-port=0"])
                .args([&profile, &url])
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap()
        });
        child.map(Self)
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Times its memory after a minute that a process may take at the end: the dashboard serves its first page in between.
const GROWS: f64 = 1.15;

#[test]
#[ignore = "takes ten minutes and prints a table"]
fn a_long_drive_loses_nothing_and_its_memory_stays_the_same() {
    let minutes: f64 = setting("TRUERATE_MINUTES", "10").parse().unwrap();
    let (rate, reference) = (setting("TRUERATE_RATE", "1000"), setting("TRUERATE_REFERENCE", "encoder"));
    let place = Place::new();
    let config = place.file("vehicle.toml");
    let text = format!("hide = [\"delay\"]\n[simulation]\nrate_hz = {rate}.0\nreference = \"{reference}\"\n");
    fs::write(&config, text).unwrap();
    let mut pipeline = place.start_watched("soak", "127.0.0.1:0", &["--config", config.to_str().unwrap()]);
    pipeline.until("every process", |p| {
        SERVICES.iter().all(|service| p.pid(service).is_some()) && p.domain.folder().join("dashboard.url").exists()
    });
    pipeline.until += Duration::from_secs_f64(60.0 * minutes);
    let mut counts = Counts::join(&pipeline);
    let minute = Duration::from_secs(60);
    let half = minute.mul_f64(minutes / 2.0);
    counts.over(minute);
    let first = all(&pipeline);
    let (mut epochs, mut given) = counts.over(half.saturating_sub(minute));
    let middle = all(&pipeline);
    let page = Page::open(&place, &pipeline);
    let watched = page.is_some();
    // The page is drawn whole before it counts.
    let (more, again) = counts.over(minute.mul_f64(0.2));
    let opened = all(&pipeline);
    let rest = counts.over(half.saturating_sub(minute.mul_f64(0.2)));
    (epochs, given) = (epochs + more + rest.0, given + again + rest.1);
    let last = all(&pipeline);
    drop((page, counts));
    let seconds = minutes * 60.0 - 60.0;
    let ended = pipeline.interrupt();

    println!("| process | MB, minute 1 | MB, minute {minutes:.0} | % of a core | with a page open |");
    println!("| --- | --- | --- | --- | --- |");
    let without = half.saturating_sub(minute).as_secs_f64();
    let with = half.saturating_sub(minute.mul_f64(0.2)).as_secs_f64();
    for (k, name) in SERVICES.iter().copied().chain(["supervisor"]).enumerate() {
        let share = |from: &[(f64, f64)], to: &[(f64, f64)], time: f64| 100.0 * (to[k].1 - from[k].1) / time;
        let open = if watched { format!("{:.1}", share(&opened, &last, with)) } else { "no Chromium".to_owned() };
        let alone = share(&first, &middle, without);
        println!("| {name} | {:.0} | {:.0} | {alone:.1} | {open} |", first[k].0, last[k].0);
    }
    println!(
        "\nsets of parameters a second: {:.2}, diagnoses a second: {:.2}",
        epochs as f64 / seconds,
        given as f64 / seconds
    );
    println!("{}", ended.out);
    for (k, name) in SERVICES.iter().enumerate() {
        let (before, after) = (first[k].0, last[k].0);
        assert!(after < GROWS * before, "{name}: {before:.0} MB after a minute, {after:.0} at the end");
    }
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    for process in ["acquisition", "kalman", "compensator", "dashboard"] {
        assert_eq!(crate::harness::counted(&ended.out, process, "lost"), 0, "{}", ended.out);
    }
}
