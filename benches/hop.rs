//! One hop over shared memory, and the way from a sample to its estimate, beside bare iceoryx2 doing the same hops.

#![allow(missing_docs)] // criterion_group! makes public functions

mod ratio;

use criterion::{Criterion, criterion_group, criterion_main};
use gyro_model::{
    Axis, AxisModel, Model, Row,
    estimator::{self, Estimator},
};
use iceoryx2::prelude::{Config, FileName, NodeBuilder, Path, SemanticString, SignalHandlingMode, ipc};
use ipc_types::{
    Estimate, Sample,
    domain::Domain,
    port::{Hub, Reader, Writer},
    topic::{ESTIMATE, SAMPLE},
    wait::Wait,
};
use std::{hint::black_box, time::Duration};

/// A place for one domain; with it goes what iceoryx2 leaves of the domain in shared memory.
struct Place {
    folder: tempfile::TempDir,
    prefix: String,
}

impl Drop for Place {
    fn drop(&mut self) {
        for entry in std::fs::read_dir("/dev/shm").into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }
}

/// A domain of its own that is gone afterwards: the place is dropped last.
struct Ours {
    samples: (Writer<Sample>, Reader<Sample>),
    estimates: (Writer<Estimate>, Reader<Estimate>),
    _held: ipc_types::port::Held,
    _hub: Hub,
    _place: Place,
}

impl Ours {
    fn new(wait: Wait) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let domain = Domain::new(folder.path(), "bench").unwrap();
        std::fs::create_dir(domain.folder()).unwrap();
        domain.begin_generation().unwrap();
        let hub = Hub::join(&domain, "bench").unwrap();
        let held = hub.create_all().unwrap();
        let samples = (hub.writer(&SAMPLE).unwrap(), hub.reader(&SAMPLE, None, wait).unwrap());
        let estimates = (hub.writer(&ESTIMATE).unwrap(), hub.reader(&ESTIMATE, None, wait).unwrap());
        let place = Place { folder, prefix: domain.prefix().to_owned() };
        Self { samples, estimates, _held: held, _hub: hub, _place: place }
    }

    fn hop(&self) -> u64 {
        self.samples.0.give(Sample::EMPTY).unwrap();
        self.samples.1.wait(Duration::from_secs(1)).unwrap();
        self.samples.1.take().unwrap().unwrap().sequence
    }
}

type Port<M> = (
    iceoryx2::port::publisher::Publisher<ipc::Service, M, ()>,
    iceoryx2::port::notifier::Notifier<ipc::Service>,
    iceoryx2::port::subscriber::Subscriber<ipc::Service, M, ()>,
    iceoryx2::port::listener::Listener<ipc::Service>,
);

/// The same without the port layer.
struct Bare {
    samples: Port<Sample>,
    estimates: Port<Estimate>,
    _place: Place,
}

impl Bare {
    fn new() -> Self {
        let place = Place { folder: tempfile::tempdir().unwrap(), prefix: format!("bare{}_", std::process::id()) };
        let mut config = Config::default();
        config.global.set_root_path(&Path::new(place.folder.path().to_str().unwrap().as_bytes()).unwrap());
        config.global.prefix = FileName::new(place.prefix.as_bytes()).unwrap();
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .unwrap();
        macro_rules! port {
            ($name:literal, $message:ty) => {{
                let name = $name.try_into().unwrap();
                let stream = node
                    .service_builder(&name)
                    .publish_subscribe::<$message>()
                    .subscriber_max_buffer_size(SAMPLE.buffer)
                    .open_or_create()
                    .unwrap();
                let event = node.service_builder(&name).event().open_or_create().unwrap();
                (
                    stream.publisher_builder().max_loaned_samples(1).create().unwrap(),
                    event.notifier_builder().create().unwrap(),
                    stream.subscriber_builder().buffer_size(SAMPLE.buffer).create().unwrap(),
                    event.listener_builder().create().unwrap(),
                )
            }};
        }
        Self { samples: port!("sample", Sample), estimates: port!("estimate", Estimate), _place: place }
    }

    fn hop(&self) -> u64 {
        let (publisher, notifier, subscriber, listener) = &self.samples;
        publisher.loan_uninit().unwrap().write_payload(Sample::EMPTY).send().unwrap();
        notifier.notify().unwrap();
        listener.timed_wait(|_| {}, Duration::from_secs(1)).unwrap();
        subscriber.receive().unwrap().unwrap().sequence
    }

    fn hop_back(&self) -> u64 {
        let (publisher, notifier, subscriber, listener) = &self.estimates;
        publisher.loan_uninit().unwrap().write_payload(Estimate::default()).send().unwrap();
        notifier.notify().unwrap();
        listener.timed_wait(|_| {}, Duration::from_secs(1)).unwrap();
        subscriber.receive().unwrap().unwrap().sequence
    }
}

/// From a sample given to its estimate taken: two hops and the estimator between them.
fn sample_to_estimate(ports: &Ours) -> impl FnMut() + '_ {
    let mut estimator = Estimator::new(estimator::Options::default());
    let mut axis = AxisModel::base(Axis::X);
    axis.noise.angle_random_walk = 1e-4;
    estimator.set_model(&Model { epoch: 1, axes: [Some(axis), None, None], ..Model::default() });
    let mut t_ns = 0;
    move || {
        t_ns += 1_000_000;
        let gyro = [(t_ns as f64 * 1e-9).sin(), f64::NAN, f64::NAN];
        ports.samples.0.give(Sample { time_ns: t_ns, gyro, ..Sample::EMPTY }).unwrap();
        ports.samples.1.wait(Duration::from_secs(1)).unwrap();
        let sample = ports.samples.1.take().unwrap().unwrap();
        let estimate = estimator.step(&Row { t_ns: sample.time_ns, gyro: sample.gyro, ..Row::EMPTY });
        let mut message = Estimate { epoch: estimate.epoch, ..Estimate::default() };
        message.axes[0].rate = estimate.axes[0].rate_filtered;
        ports.estimates.0.give(message).unwrap();
        ports.estimates.1.wait(Duration::from_secs(1)).unwrap();
        black_box(ports.estimates.1.take().unwrap().unwrap().axes[0].rate);
    }
}

fn hops(c: &mut Criterion) {
    let (event, spin, bare) = (Ours::new(Wait::Event), Ours::new(Wait::Spin), Bare::new());
    let mut group = c.benchmark_group("hop");
    group.bench_function("through the port layer, event", |b| b.iter(|| black_box(event.hop())));
    group.bench_function("through the port layer, spin", |b| b.iter(|| black_box(spin.hop())));
    group.bench_function("bare iceoryx2", |b| b.iter(|| black_box(bare.hop())));
    group.bench_function("sample to estimate", |b| b.iter(sample_to_estimate(&event)));
    group.finish();
    ratio::ratio(
        "hop through the port layer",
        "bare iceoryx2",
        || {
            black_box(event.hop());
        },
        || {
            black_box(bare.hop());
        },
    );
    ratio::ratio("sample to estimate", "two hops of bare iceoryx2", sample_to_estimate(&event), || {
        black_box(bare.hop() + bare.hop_back());
    });
}

criterion_group!(benches, hops);
criterion_main!(benches);
