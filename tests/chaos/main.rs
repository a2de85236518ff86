//! Faults drawn by a seed: any process of a vehicle's pipeline is killed, stopped or hung at any time, two at once, at its start, as an
//! update of the parameters arrives, and the supervisor too, while a control loop in C takes every rate.
//!
//! ```console
//! $ cargo test --test chaos                                       # 50 faults
//! $ CHAOS_FAULTS=10000 cargo test --release --test chaos -- --ignored --nocapture
//! ```
//!
//! `CHAOS_SEED` draws others. The figures are in `docs/faults.md`.

mod fault;
#[allow(dead_code, reason = "shared with the pipeline's tests")]
#[path = "../pipeline/harness.rs"]
mod harness;
mod vehicle;

use fault::{Fault, Swing, VICTIMS, Victim};
use harness::{DEADLINE, Pipeline, Place, signal};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;
use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    net::UdpSocket,
    time::{Duration, Instant},
};
use truerate::clock::now_ns;
use vehicle::{Control, Sensor, Taken};

const INSTANCE: &str = "chaos";
/// A process that has lived for so long is no early death.
const GROWN: Duration = Duration::from_millis(1_100);
/// What the rate may be off by: the motion of half a second, rad/s.
const WRONG: f64 = 0.03;

/// What the faults of one kind did.
#[derive(Default)]
struct Outcome {
    /// Longest time without a new rate, ms, of each fault.
    outages: Vec<f64>,
    /// Samples that were numbered and never came out as a rate.
    lost: u64,
}

struct Chaos<'a> {
    place: &'a Place,
    args: Vec<String>,
    pipeline: Pipeline,
    control: Control,
    swing: Swing,
    born: BTreeMap<Victim, Instant>,
    last: Option<Taken>,
    rates: u64,
    /// Rows that were written over before the control loop read them.
    unread: u64,
    outcomes: BTreeMap<String, Outcome>,
    replaced_in_vain: u64,
}

impl Chaos<'_> {
    /// Does it, and waits until the pipeline is whole again.
    fn suffer(&mut self, fault: &Fault, random: &mut ChaCha8Rng) {
        self.pipeline.until = Instant::now() + DEADLINE;
        for victim in fault.touched() {
            let young = GROWN.saturating_sub(self.born.get(&victim).map_or(GROWN, Instant::elapsed));
            std::thread::sleep(young);
        }
        std::thread::sleep(Duration::from_micros(random.random_range(0..100_000)));
        let before: Vec<(Victim, u32)> = fault.touched().iter().map(|&victim| (victim, self.pid(victim))).collect();
        let rows = self.control.take();
        let (_, lost) = self.judge("quiet", &rows);
        assert_eq!(lost, 0, "nothing is lost without a fault\n{}", self.pipeline.errors());
        let kill_all = || {
            for &(_, pid) in &before {
                signal(pid, Signal::KILL);
            }
        };
        match *fault {
            Fault::Kill(_) | Fault::KillTwo(..) => kill_all(),
            Fault::KillInUpdate(_) => {
                let epoch = |control: &Control| control.newest().map_or(0, |row| row.epoch);
                let (old, until) = (epoch(&self.control), Instant::now() + Duration::from_secs(1));
                while epoch(&self.control) == old && Instant::now() < until {
                    std::thread::sleep(Duration::from_micros(100));
                }
                kill_all();
            }
            Fault::KillAtStart(victim, later) => {
                let (_, pid) = before[0];
                signal(pid, Signal::KILL);
                let next = self.next_life(victim, pid);
                std::thread::sleep(later);
                signal(next, Signal::KILL);
                self.next_life(victim, next);
            }
            Fault::Hang(_) => signal(before[0].1, Signal::STOP),
            Fault::Hiccup(victim, pause) => {
                signal(before[0].1, Signal::STOP);
                std::thread::sleep(pause);
                signal(before[0].1, Signal::CONT);
                std::thread::sleep(Duration::from_millis(30));
                self.replaced_in_vain += u64::from(self.pid(victim) != before[0].1);
            }
            Fault::Supervisor => {
                let args: Vec<&str> = self.args.iter().map(String::as_str).collect();
                self.place.supervise_again(&mut self.pipeline, &args);
            }
        }
        for victim in fault.dead() {
            let dead = before.iter().find(|(of, _)| *of == victim).unwrap().1;
            self.next_life(victim, dead);
            self.born.insert(victim, Instant::now());
        }
        self.until_rates(50);
        let rows = self.control.take();
        let (outage, lost) = self.judge(&fault.kind(), &rows);
        let outcome = self.outcomes.entry(fault.kind()).or_default();
        outcome.outages.push(outage);
        outcome.lost += lost;
        if fault.spares_the_rate() {
            assert_eq!(lost, 0, "{fault:?}: no sample is lost between processes that live\n{}", self.pipeline.errors());
        }
    }

    fn pid(&mut self, victim: Victim) -> u32 {
        let mut found = None;
        self.pipeline.until(victim.name(), |pipeline| {
            found = pipeline.pid(victim.name());
            found.is_some()
        });
        found.unwrap()
    }

    fn next_life(&mut self, victim: Victim, dead: u32) -> u32 {
        let mut next = None;
        self.pipeline.until(&format!("another {}", victim.name()), |pipeline| {
            next = pipeline.pid(victim.name()).filter(|&pid| pid != dead);
            next.is_some()
        });
        next.unwrap()
    }

    fn until_rates(&mut self, count: u64) {
        let now = now_ns();
        let Self { pipeline, control, .. } = self;
        let first = control.newest().map_or(0, |row| row.number);
        pipeline.until("new rates", |_| {
            control.newest().is_some_and(|row| row.given_ns > now && row.number >= first + count)
        });
    }

    /// Holds rows against the motion; the longest time without a new one, ms, and how many samples are missing among them.
    fn judge(&mut self, kind: &str, rows: &[Taken]) -> (f64, u64) {
        let (mut longest, mut lost) = (0, 0);
        for row in rows {
            if self.last.is_some_and(|last| last.number == row.number) {
                continue;
            }
            let wrong = (row.rate - self.swing.rate(row.valid_ns)).abs();
            assert!(wrong < WRONG && row.std.is_finite(), "{kind}: {row:?} is off by {wrong} rad/s");
            if let Some(last) = self.last {
                assert!(row.epoch >= last.epoch, "{kind}: epoch {} after {}", row.epoch, last.epoch);
                assert!(row.sequence > last.sequence, "{kind}: {row:?} after {last:?}");
                self.unread += row.number - last.number - 1;
                lost += (row.sequence - last.sequence).saturating_sub(row.number - last.number);
                longest = longest.max(row.given_ns.saturating_sub(last.given_ns));
            }
            self.rates += 1;
            self.last = Some(*row);
        }
        (longest as f64 * 1e-6, lost)
    }

    /// Resident memory of every process, KiB.
    fn memory(&self) -> u64 {
        let of = |pid: u32| {
            let text = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
            let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or("0").to_owned();
            line.split_whitespace().next().map_or(0, |word| word.parse::<u64>().unwrap())
        };
        let services = VICTIMS.iter().filter_map(|victim| self.pipeline.pid(victim.name()));
        services.chain([self.pipeline.child.id()]).map(of).sum()
    }

    fn tell(&self) {
        eprintln!("{:<36} {:>6} {:>9} {:>9} {:>9} {:>8}", "fault", "count", "p50, ms", "p99, ms", "max, ms", "lost");
        for (kind, outcome) in &self.outcomes {
            let mut outages = outcome.outages.clone();
            outages.sort_by(f64::total_cmp);
            let at = |q: f64| outages[((outages.len() - 1) as f64 * q).round() as usize];
            let (p50, p99, max) = (at(0.5), at(0.99), at(1.0));
            eprintln!("{kind:<36} {:>6} {p50:>9.1} {p99:>9.1} {max:>9.1} {:>8}", outages.len(), outcome.lost);
        }
    }
}

fn shared_memory(place: &Place) -> BTreeSet<String> {
    place.left(INSTANCE).into_iter().filter(|name| !name.starts_with('/')).collect()
}

fn drawn(key: &str, or: u64) -> u64 {
    std::env::var(key).ok().map_or(or, |text| text.parse().unwrap())
}

fn faults(count: u64, seed: u64) {
    let place = Place::new();
    let ring = place.file("rate");
    // A port that was free a moment ago.
    let to = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let swing = Swing { start_ns: now_ns() };
    let words =
        ["--source", &format!("udp:{to}?header=t,gyro_z,ref_angle_z"), "--out", &format!("shm:{}", ring.display())];
    let args = words.map(str::to_owned).to_vec();
    let Some(control) = Control::start(&place, &ring) else { return };
    let sensor = Sensor::start(to, swing);
    let pipeline = place.start(INSTANCE, &words);
    let mut chaos = Chaos {
        place: &place,
        args,
        pipeline,
        control,
        swing,
        born: BTreeMap::new(),
        last: None,
        rates: 0,
        unread: 0,
        outcomes: BTreeMap::new(),
        replaced_in_vain: 0,
    };
    chaos.until_rates(2_000);
    // The filter's first rates are those of an unknown bias.
    chaos.last = chaos.control.take().last().copied();
    let (memory, segments, begun) = (chaos.memory(), shared_memory(&place), Instant::now());
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for number in 1..=count {
        let fault = Fault::draw(&mut random);
        chaos.suffer(&fault, &mut random);
        if number % 25 == 0 {
            chaos.pipeline.until("a status", |_| {
                place
                    .status(INSTANCE)
                    .is_some_and(|status| status["services"].as_array().is_some_and(|all| all.len() == 3))
            });
        }
        if number % 500 == 0 {
            // A run that is ended before its time has figures too.
            chaos.tell();
            eprintln!("{number} faults in {:.0} s", begun.elapsed().as_secs_f64());
        }
    }
    let until = Instant::now() + DEADLINE;
    while shared_memory(&place).len() > segments.len() {
        assert!(
            Instant::now() < until,
            "what the dead left stays: of {:#?}\nat first {segments:#?}\n{}",
            shared_memory(&place),
            chaos.pipeline.errors(),
        );
        std::thread::sleep(Duration::from_millis(5));
    }
    chaos.tell();
    eprintln!(
        "{count} faults of seed {seed} in {:.0} s: {} rates, {} written over unread; {} replaced that had only paused; memory {} MiB, {} at first",
        begun.elapsed().as_secs_f64(),
        chaos.rates,
        chaos.unread,
        chaos.replaced_in_vain,
        chaos.memory() / 1024,
        memory / 1024,
    );
    let Chaos { pipeline, control, .. } = chaos;
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert!(!ended.error.contains("begun again"), "{}", ended.error);
    control.end();
    assert!(sensor.end() > 0);
    assert!(!ring.exists(), "the shared memory is gone");
    assert!(place.left(INSTANCE).is_empty(), "{:?}", place.left(INSTANCE));
}

#[test]
fn fifty_faults_leave_nothing_wrong_lost_or_behind() {
    faults(50, drawn("CHAOS_SEED", 1));
}

#[test]
#[ignore = "takes an hour or more"]
fn ten_thousand_faults_leave_nothing_wrong_lost_or_behind() {
    faults(drawn("CHAOS_FAULTS", 10_000), drawn("CHAOS_SEED", 1));
}
