//! A log of 50 MB, read from the file into rows: text to numbers, times to nanoseconds, every row checked.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::{fmt::Write as _, hint::black_box};
use workbench::log::{Options, Reader};

const BYTES: usize = 50_000_000;

/// Six channels at 1 kHz, as a logger writes them.
fn text() -> String {
    let mut text = String::from("t,gyro_x,gyro_y,gyro_z,ref_angle_z,temp\n");
    for k in 0_u32.. {
        let t = f64::from(k) * 1e-3;
        let (x, y, z) = ((1.1 * t).sin(), (1.3 * t).cos(), (0.7 * t).sin() * 3.0);
        let _ =
            writeln!(text, "{t:.3},{x:.6},{y:.6},{z:.6},{:.5},{:.2}", -3.0 / 0.7 * (0.7 * t).cos(), 25.0 + 1e-3 * t);
        if text.len() >= BYTES {
            break;
        }
    }
    text
}

fn read(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    std::fs::write(&path, text()).expect("room");
    let mut group = c.benchmark_group("read");
    group.sample_size(10).throughput(Throughput::Bytes(BYTES as u64));
    group.bench_function("csv", |b| {
        b.iter(|| {
            let mut reader = Reader::open(&path, &Options::default()).expect("a log");
            let mut rows = 0_u64;
            while let Some(row) = reader.next_row().expect("a row") {
                black_box(row);
                rows += 1;
            }
            rows
        });
    });
    group.finish();
}

criterion_group!(benches, read);
criterion_main!(benches);
