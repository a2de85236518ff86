//! Ports within one process, each test in its own domain.

use ipc_types::{
    Command, Parameters, Reply, Sample,
    domain::Domain,
    port::{Hub, inhabited},
    topic::{self, Topic},
    wait::Wait,
};
use std::{path::PathBuf, time::Duration};

struct Place(Domain, PathBuf);

impl Place {
    fn new(name: &str) -> Self {
        let base = std::env::temp_dir().join(format!("truerate-ports-{}", std::process::id()));
        let domain = Domain::new(&base, name).unwrap();
        std::fs::create_dir_all(domain.root()).unwrap();
        domain.begin_generation().unwrap();
        Self(domain, base)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(self.0.folder());
        let _ = std::fs::remove_dir(&self.1);
        for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(self.0.prefix()) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

#[test]
fn a_message_arrives_as_it_was_given_and_wakes_its_reader() {
    let place = Place::new("arrives");
    let hub = Hub::join(&place.0, "test").unwrap();
    let _held = hub.create_all().unwrap();
    for wait in [Wait::Event, Wait::Spin, Wait::Hybrid(Duration::from_micros(10))] {
        let writer = hub.writer(&topic::SAMPLE).unwrap();
        let reader = hub.reader(&topic::SAMPLE, None, wait).unwrap();
        let sample = Sample { sequence: 7, temperature: 20.0, ..Sample::EMPTY };
        assert_eq!(writer.give(sample).unwrap(), 1);
        reader.wait(Duration::from_secs(10)).unwrap();
        assert_eq!(reader.take().unwrap().unwrap().sequence, 7);
        assert!(reader.take().unwrap().is_none());
    }
}

#[test]
fn a_late_joiner_gets_the_last_parameters() {
    let place = Place::new("late");
    let hub = Hub::join(&place.0, "test").unwrap();
    let _held = hub.create_all().unwrap();
    let writer = hub.writer(&topic::PARAMETERS).unwrap();
    for epoch in 1..=3 {
        writer.give(Parameters { epoch, ..Parameters::default() }).unwrap();
    }
    let reader = hub.reader(&topic::PARAMETERS, None, Wait::Event).unwrap();
    writer.connect().unwrap();
    assert_eq!(reader.newest().unwrap().unwrap().epoch, 3);
}

#[test]
fn another_definition_of_a_message_is_refused() {
    let place = Place::new("schema");
    let hub = Hub::join(&place.0, "test").unwrap();
    let _held = hub.create_all().unwrap();
    let other = Topic::<Sample>::new("sample", topic::SAMPLE.schema + 1, topic::QUEUE);
    let error = hub.reader(&other, None, Wait::Event).unwrap_err();
    assert!(error.to_string().contains("IncompatibleAttributes"), "{error}");
    let other = Topic::<[u8]>::new("report", topic::REPORT.schema + 1, 1);
    for error in [hub.bytes_reader(&other).err(), hub.bytes_writer(&other, 100).err()] {
        let error = error.unwrap().to_string();
        assert!(error.contains("IncompatibleAttributes"), "{error}");
    }
    assert!(hub.bytes_reader(&topic::REPORT).is_ok() && hub.bytes_writer(&topic::REPORT, 100).is_ok());
}

#[test]
fn a_question_is_answered_and_silence_is_an_error() {
    let place = Place::new("answer");
    let hub = Hub::join(&place.0, "test").unwrap();
    let _held = hub.create_all().unwrap();
    let caller = hub.caller(&topic::CONTROL).unwrap();
    let command = Command { id: 5, ..Command::default() };
    let patience = Duration::from_millis(20);
    assert!(caller.ask(command, patience, 1, |_: &Reply| true).is_err());
    let domain = place.0.clone();
    let (ready, is_ready) = std::sync::mpsc::channel();
    let (done, is_done) = std::sync::mpsc::channel::<()>();
    let thread = std::thread::spawn(move || {
        let hub = Hub::join(&domain, "answerer").unwrap();
        let server = hub.answerer(&topic::CONTROL).unwrap();
        ready.send(()).unwrap();
        while is_done.try_recv().is_err() {
            server.serve(|q| Some(Reply { id: q.id, epoch: 9, ..Reply::default() })).unwrap();
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    is_ready.recv().unwrap();
    let reply = caller.ask(command, Duration::from_secs(1), 20, |r: &Reply| r.id == 5).unwrap();
    assert_eq!(reply.epoch, 9);
    done.send(()).unwrap();
    thread.join().unwrap();
}

#[test]
fn a_domain_is_inhabited_while_somebody_is_there() {
    let place = Place::new("alive");
    assert!(!inhabited(&place.0).unwrap());
    let hub = Hub::join(&place.0, "test").unwrap();
    assert!(inhabited(&place.0).unwrap());
    drop(hub);
    assert!(!inhabited(&place.0).unwrap());
}
