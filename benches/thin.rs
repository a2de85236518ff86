//! Means of a live stream, as the compensator takes them twice a second: what was averaged before kept, beside the whole
//! stream averaged anew.

#![allow(missing_docs)] // criterion_group! makes public functions

mod ratio;

use criterion::{Criterion, criterion_group, criterion_main};
use gyro_model::{
    Record,
    simulate::{Motion, Scenario, simulate},
    thin::{Growing, thinned},
};
use std::hint::black_box;

/// Means that one solution looks at.
const MOST: usize = 8000;

/// Five minutes at 1 kHz.
fn stream() -> Record {
    let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
    simulate(&Scenario { motion, seconds: 300.0, rate_hz: 1000.0, ..Scenario::default() }).record
}

fn thin(c: &mut Criterion) {
    let stream = stream();
    let mut growing = Growing::new(stream.len());
    let mut group = c.benchmark_group("means of a stream");
    group.sample_size(10);
    group.bench_function("what has come since", |b| b.iter(|| black_box(growing.thinned(&stream, MOST))));
    group.bench_function("the whole anew", |b| b.iter(|| black_box(thinned(&stream, MOST))));
    group.finish();
}

fn ratios(_: &mut Criterion) {
    let stream = stream();
    let mut growing = Growing::new(stream.len());
    ratio::ratio(
        "what has come since",
        "the whole anew",
        || drop(black_box(growing.thinned(&stream, MOST))),
        || drop(black_box(thinned(&stream, MOST))),
    );
}

criterion_group!(benches, thin, ratios);
criterion_main!(benches);
