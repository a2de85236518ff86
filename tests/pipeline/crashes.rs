//! Processes that are killed: the others go on, the dead come back, nothing is lost that could be kept.

use crate::harness::{Pipeline, Place, counted, log, signal};
use ipc_types::{
    Estimate,
    estimate::FLAG_STALE_PARAMETERS,
    port::{Hub, Reader},
    topic,
    wait::Wait,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::process::Signal;
use std::{fs::File, path::PathBuf, time::Duration};

const SERVICES: [&str; 3] = ["acquisition", "kalman", "compensator"];

/// An onlooker of the estimates.
struct Onlooker {
    estimates: Reader<Estimate>,
    last: Estimate,
    _hub: Hub,
}

impl Onlooker {
    fn join(pipeline: &mut Pipeline) -> Self {
        // The topics are there before any process is.
        pipeline.until("kalman", |p| p.pid("kalman").is_some());
        let mut joined = None;
        pipeline.until("the topics", |p| {
            let hub = Hub::join(&p.domain, "onlooker");
            let reader = hub.and_then(|hub| Ok((hub.reader(&topic::ESTIMATE, None, Wait::Event)?, hub)));
            // Shown where the wait is in vain.
            joined = reader.inspect_err(|error| eprintln!("{error}")).ok();
            joined.is_some()
        });
        let (estimates, hub) = joined.unwrap();
        Self { estimates, last: Estimate::default(), _hub: hub }
    }

    /// Takes what waits. Numbers and times never go back.
    fn look(&mut self) {
        while let Some(estimate) = self.estimates.take().unwrap() {
            assert!(
                estimate.sequence > self.last.sequence || estimate.sequence + topic::QUEUE as u64 > self.last.sequence,
                "{} after {}",
                estimate.sequence,
                self.last.sequence
            );
            if estimate.sequence > self.last.sequence {
                self.last = estimate;
            }
        }
    }

    fn until_on(&mut self, pipeline: &mut Pipeline, what: &str) {
        self.look();
        let before = self.last.sequence;
        pipeline.until(what, |_| {
            self.look();
            self.last.sequence > before
        });
    }
}

fn kill(pipeline: &mut Pipeline, service: &str) -> u32 {
    let mut victim = None;
    pipeline.until("a victim", |p| {
        victim = p.pid(service);
        victim.is_some()
    });
    let pid = victim.unwrap();
    signal(pid, Signal::KILL);
    pid
}

fn until_back(pipeline: &mut Pipeline, service: &str, dead: u32) {
    pipeline.until("its next life", |p| p.pid(service).is_some_and(|pid| pid != dead));
}

#[test]
fn whatever_is_killed_comes_back_while_the_others_go_on() {
    killed(5);
}

#[test]
#[ignore = "minutes: run by tests/nightly"]
fn whatever_is_killed_forty_times_comes_back() {
    killed(40);
}

/// Each service is killed so often, and every fifth time once more while it starts.
fn killed(times: usize) {
    let place = Place::new();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut pipeline = place.start("kills", &["--source", "sim"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    let mut epoch = 0;
    for round in 0..times {
        for service in SERVICES {
            let dead = kill(&mut pipeline, service);
            if round % 5 == 4 {
                // Once more while it starts.
                until_back(&mut pipeline, service, dead);
                std::thread::sleep(Duration::from_micros(random.random_range(0..12_000)));
                let again = kill(&mut pipeline, service);
                until_back(&mut pipeline, service, again);
            } else {
                until_back(&mut pipeline, service, dead);
            }
            onlooker.until_on(&mut pipeline, "estimates after a death");
            assert!(onlooker.last.epoch >= epoch, "epoch {} after {epoch}", onlooker.last.epoch);
            epoch = onlooker.last.epoch;
            assert!(onlooker.last.axes[0].rate.is_finite());
            // Random moments, and no more than two deaths of one process in ten seconds.
            let pause = random.random_range(1_300..2_000);
            for _ in 0..pause / 50 {
                onlooker.look();
                std::thread::sleep(Duration::from_millis(50));
            }
        }
    }
    let status = place.status("kills").unwrap();
    for service in status["services"].as_array().unwrap() {
        let restarts = service["restarts"].as_u64().unwrap();
        assert!(restarts >= times as u64, "{service}");
    }
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let (taken, lost) = (counted(&ended.out, "kalman", "in"), counted(&ended.out, "kalman", "lost"));
    assert!(taken > 0 && lost > 0, "{taken} taken, {lost} lost: a vehicle does not wait\n{}", ended.out);
    assert!(place.left("kills").is_empty(), "{:?}", place.left("kills"));
}

#[test]
fn one_that_is_killed_again_and_again_at_its_start_is_back_at_once_each_time() {
    let place = Place::new();
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut pipeline = place.start("early", &["--source", "sim"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    let others = |p: &Pipeline| [p.pid("acquisition"), p.pid("compensator")];
    let before = others(&pipeline);
    let mut dead = kill(&mut pipeline, "kalman");
    for _ in 0..14 {
        until_back(&mut pipeline, "kalman", dead);
        std::thread::sleep(Duration::from_millis(random.random_range(0..60)));
        dead = kill(&mut pipeline, "kalman");
    }
    until_back(&mut pipeline, "kalman", dead);
    onlooker.until_on(&mut pipeline, "estimates after the last death");
    assert_eq!(others(&pipeline), before, "the others went on");
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let delays: Vec<&str> =
        ended.error.lines().filter_map(|line| Some(line.split_once("it is started again in ")?.1)).collect();
    assert!(delays.len() > 5 && delays.iter().all(|delay| *delay == "100.00ms"), "{delays:?}\n{}", ended.error);
    assert!(place.left("early").is_empty(), "{:?}", place.left("early"));
}

/// A process that is killed between making shared memory and giving it a size leaves a segment that iceoryx2 waits for
/// without end, wherever its node is cleared.
#[test]
fn a_process_killed_while_it_makes_shared_memory_stops_nobody() {
    let place = Place::new();
    let mut pipeline = place.start("halfmade", &["--source", "sim"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    let supervisor = pipeline.child.id();
    // Nobody clears the dead node before it has left what such a death leaves.
    signal(supervisor, Signal::STOP);
    let before: Vec<u32> = SERVICES.iter().map(|s| pipeline.pid(s).unwrap()).collect();
    signal(before[1], Signal::KILL);
    let made: Vec<PathBuf> = place
        .left("halfmade")
        .iter()
        .filter_map(|name| name.strip_suffix(".connection")?.rsplit_once('_'))
        .map(|(maker, _)| PathBuf::from(format!("/dev/shm/{maker}_1.connection")))
        .collect();
    assert!(!made.is_empty());
    for path in &made {
        File::create(path).unwrap();
    }
    signal(supervisor, Signal::CONT);
    until_back(&mut pipeline, "kalman", before[1]);
    onlooker.until_on(&mut pipeline, "estimates after such a death");
    pipeline.until("an end of what was half made", |_| made.iter().all(|path| !path.exists()));
    let again = kill(&mut pipeline, "kalman");
    until_back(&mut pipeline, "kalman", again);
    onlooker.until_on(&mut pipeline, "estimates after the next death");
    for (k, service) in [(0, "acquisition"), (2, "compensator")] {
        assert_eq!(pipeline.pid(service), Some(before[k]), "{service} went on");
    }
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(place.left("halfmade").is_empty(), "{:?}", place.left("halfmade"));
}

#[test]
fn a_replayed_log_is_taken_up_after_the_last_acknowledged_row() {
    let place = Place::new();
    let path = place.file("log.csv");
    let rows = log(&path, 30.0, 3).record.len() as u64;
    let mut pipeline = place.start("resume", &["--source", path.to_str().unwrap(), "--speed", "5"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    for at in [rows / 4, rows / 2, 3 * rows / 4] {
        pipeline.until("the next death", |_| {
            onlooker.look();
            onlooker.last.sequence > at
        });
        let dead = kill(&mut pipeline, "acquisition");
        until_back(&mut pipeline, "acquisition", dead);
    }
    drop(onlooker);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
    assert_eq!(counted(&ended.out, "kalman", "in"), rows, "{}", ended.out);
    assert_eq!(counted(&ended.out, "kalman", "lost"), 0, "{}", ended.out);
    assert!(place.left("resume").is_empty(), "{:?}", place.left("resume"));
}

#[test]
fn an_unpaced_log_loses_nothing_whoever_is_killed() {
    let place = Place::new();
    let path = place.file("log.csv");
    let rows = log(&path, 600.0, 4).record.len() as u64;
    for victim in SERVICES {
        let mut pipeline = place.start(victim, &["--source", path.to_str().unwrap(), "--speed", "max"]);
        let mut onlooker = Onlooker::join(&mut pipeline);
        for at in [rows / 8, rows / 3] {
            pipeline.until("the next death", |_| {
                onlooker.look();
                onlooker.last.sequence > at
            });
            let dead = kill(&mut pipeline, victim);
            until_back(&mut pipeline, victim, dead);
        }
        drop(onlooker);
        let ended = pipeline.end();
        assert_eq!(ended.code, Some(0), "{victim}: {}{}", ended.out, ended.error);
        for process in ["kalman", "compensator"] {
            assert_eq!(counted(&ended.out, process, "in"), rows, "{victim}: {}", ended.out);
            assert_eq!(counted(&ended.out, process, "lost"), 0, "{victim}: {}", ended.out);
        }
        assert!(place.left(victim).is_empty(), "{:?}", place.left(victim));
    }
}

#[test]
fn parameters_are_marked_stale_while_the_compensator_is_gone() {
    let place = Place::new();
    let mut pipeline = place.start("stale", &["--source", "sim"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    pipeline.until("fresh parameters", |_| {
        onlooker.look();
        onlooker.last.flags & FLAG_STALE_PARAMETERS == 0
    });
    let pid = pipeline.pid("compensator").unwrap();
    // Who would begin another one.
    signal(pipeline.child.id(), Signal::STOP);
    signal(pid, Signal::STOP);
    pipeline.until("stale parameters", |_| {
        onlooker.look();
        onlooker.last.flags & FLAG_STALE_PARAMETERS != 0
    });
    signal(pid, Signal::CONT);
    signal(pipeline.child.id(), Signal::CONT);
    pipeline.until("fresh parameters again", |_| {
        onlooker.look();
        onlooker.last.flags & FLAG_STALE_PARAMETERS == 0
    });
    drop(onlooker);
    assert_eq!(pipeline.interrupt().code, Some(0));
}

#[test]
fn a_new_supervisor_adopts_what_still_runs() {
    let place = Place::new();
    let args = ["--source", "sim"];
    let mut pipeline = place.start("orphans", &args);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    let before: Vec<u32> = SERVICES.iter().map(|s| pipeline.pid(s).unwrap()).collect();
    place.supervise_again(&mut pipeline, &args);
    onlooker.until_on(&mut pipeline, "estimates without a supervisor");
    pipeline.until("the new supervisor", |_| {
        place.status("orphans").is_some_and(|s| s["services"][1]["state"] == "running")
    });
    let after: Vec<u32> = SERVICES.iter().map(|s| pipeline.pid(s).unwrap()).collect();
    assert_eq!(before, after);
    let dead = kill(&mut pipeline, "kalman");
    until_back(&mut pipeline, "kalman", dead);
    onlooker.until_on(&mut pipeline, "estimates of an adopted pipeline");
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(place.left("orphans").is_empty(), "{:?}", place.left("orphans"));
}

#[test]
fn a_new_supervisor_of_another_build_begins_again() {
    let mut place = Place::new();
    let other = place.file("other-build");
    std::fs::copy(env!("CARGO_BIN_EXE_truerate"), &other).unwrap();
    let words = ["sh", "-c", &format!("shift; exec {} \"$@\"", other.display()), "sh"];
    place.wrapper = words.map(str::to_owned).to_vec();
    let args = ["--source", "sim"];
    let mut pipeline = place.start("updated", &args);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    drop(onlooker);
    let before = SERVICES.map(|service| pipeline.pid(service).unwrap());
    place.wrapper.clear();
    place.supervise_again(&mut pipeline, &args);
    pipeline.until("the new processes", |pipeline| {
        let after = SERVICES.map(|service| pipeline.pid(service));
        after.iter().zip(before).all(|(after, before)| after.is_some_and(|after| after != before))
    });
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "estimates of the new processes");
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(ended.error.contains("another run or build"), "{}", ended.error);
    assert!(place.left("updated").is_empty(), "{:?}", place.left("updated"));
}

#[test]
fn a_recorder_that_is_killed_goes_on_in_another_file_while_the_vehicle_drives() {
    let place = Place::new();
    let (first, second) = (place.file("run.csv"), place.file("run-2.csv"));
    let mut pipeline = place.start("recorder", &["--source", "sim", "--record", first.to_str().unwrap()]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    let others = |p: &Pipeline| SERVICES.map(|service| p.pid(service).unwrap());
    let before = others(&pipeline);
    let dead = kill(&mut pipeline, "recorder");
    until_back(&mut pipeline, "recorder", dead);
    pipeline.until("a recording that goes on", |_| {
        let status = place.status("recorder").unwrap();
        let recorder = status["services"].as_array().unwrap().iter().find(|s| s["name"] == "recorder").unwrap();
        recorder["received"].as_u64().unwrap() > 100
    });
    onlooker.until_on(&mut pipeline, "estimates");
    assert_eq!(others(&pipeline), before);
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(!first.exists(), "half a recording stands under the name of a whole one");
    let rows = std::fs::read_to_string(&second).unwrap().lines().count();
    assert!(rows > 100, "{rows} rows");
    assert!(place.left("recorder").is_empty(), "{:?}", place.left("recorder"));
}

#[test]
fn an_unpaced_run_whose_recorder_is_killed_ends_and_says_so() {
    let place = Place::new();
    let path = place.file("log.csv");
    let rows = log(&path, 600.0, 4).record.len() as u64;
    let record = place.file("run.csv");
    let args = ["--source", path.to_str().unwrap(), "--speed", "max", "--record", record.to_str().unwrap()];
    let mut pipeline = place.start("recorder", &args);
    let mut onlooker = Onlooker::join(&mut pipeline);
    pipeline.until("some rows", |_| {
        onlooker.look();
        onlooker.last.sequence > rows / 8
    });
    kill(&mut pipeline, "recorder");
    drop(onlooker);
    let ended = pipeline.end();
    assert_eq!(ended.code, Some(1), "{}{}", ended.out, ended.error);
    assert!(ended.error.contains("the recorder died, and what it had is lost"), "{}", ended.error);
    assert!(!record.exists());
    assert!(place.left("recorder").is_empty(), "{:?}", place.left("recorder"));
}

#[test]
fn a_process_that_hangs_is_ended_long_before_a_slow_one() {
    let place = Place::new();
    let mut pipeline = place.start("hung", &["--source", "sim"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    for service in SERVICES {
        pipeline.until("all at work", |_| {
            place
                .status("hung")
                .is_some_and(|s| s["services"].as_array().unwrap().iter().all(|service| service["state"] == "running"))
        });
        let hung = pipeline.pid(service).unwrap();
        signal(hung, Signal::STOP);
        until_back(&mut pipeline, service, hung);
        onlooker.until_on(&mut pipeline, "estimates after it");
    }
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    let silences: Vec<f64> = ended
        .error
        .lines()
        .filter_map(|line| line.split_once(" is silent for ")?.1.split(' ').next()?.parse().ok())
        .collect();
    assert!(silences.len() == 3 && silences.iter().all(|&s| s < 6.0), "{}", ended.error);
    assert!(place.left("hung").is_empty(), "{:?}", place.left("hung"));
}

#[test]
#[ignore = "takes the machine from every other test"]
fn nobody_is_ended_because_the_machine_is_slow() {
    let place = Place::new();
    let mut pipeline = place.start("slow", &["--source", "sim"]);
    let mut onlooker = Onlooker::join(&mut pipeline);
    onlooker.until_on(&mut pipeline, "the first estimate");
    let until = std::time::Instant::now() + Duration::from_secs(8);
    let burners: Vec<_> = (0..16)
        .map(|k| {
            std::thread::spawn(move || {
                let mut sum: u64 = k;
                while std::time::Instant::now() < until {
                    sum = std::hint::black_box(sum.wrapping_mul(31) + 7);
                }
            })
        })
        .collect();
    for burner in burners {
        burner.join().unwrap();
    }
    onlooker.until_on(&mut pipeline, "estimates after it");
    drop(onlooker);
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(!ended.error.contains("it is ended"), "{}", ended.error);
}

#[test]
fn status_is_not_blind_after_everything_was_begun_again() {
    let place = Place::new();
    let mut pipeline = place.start("reset", &["--source", "sim"]);
    pipeline.until("kalman", |p| p.pid("kalman").is_some());
    // One that looks all the time.
    let (stop, stopped) = std::sync::mpsc::channel::<()>();
    let mut look = place.truerate();
    look.args(["status", "--instance", "reset"])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null());
    let looker = std::thread::spawn(move || {
        while stopped.try_recv() == Err(std::sync::mpsc::TryRecvError::Empty) {
            look.status().unwrap();
        }
    });
    let mut dead = 0;
    pipeline.until("a new beginning", |p| {
        if let Some(pid) = p.pid("kalman").filter(|&pid| pid != dead) {
            std::thread::sleep(Duration::from_millis(30));
            // As a crash: what kills it from outside would say nothing of the domain.
            signal(pid, Signal::ABORT);
            dead = pid;
        }
        p.errors().contains("everything is ended and begun again")
    });
    pipeline.until("the status of what runs", |_| {
        place.status("reset").is_some_and(|s| s["services"][1]["state"] == "running")
    });
    drop(stop);
    looker.join().unwrap();
    let ended = pipeline.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.error);
    assert!(place.left("reset").is_empty(), "{:?}", place.left("reset"));
}
