//! Nonlinear least squares: our Levenberg–Marquardt on faer beside Gauss–Newton on nalgebra's LU, same equations.

#![allow(missing_docs)] // criterion_group! makes public functions

mod ratio;

use criterion::{Criterion, criterion_group, criterion_main};
use gyro_model::nls::{self, Normal};
use nalgebra::{DMatrix, DVector};
use std::hint::black_box;

const ROWS: usize = 2000;
const UNKNOWN: usize = 12;

/// y = Σ p_j e^{−j t/4} + p₀² t: mildly nonlinear, badly scaled as exponentials are.
/// Without `whole`, only the cost.
fn normal(p: &[f64], whole: bool) -> Normal {
    let mut r = Vec::with_capacity(ROWS);
    let mut columns: Vec<Vec<f64>> = (0..UNKNOWN).map(|_| Vec::with_capacity(ROWS)).collect();
    for k in 0..ROWS {
        let t = k as f64 / ROWS as f64;
        let mut model = p[0] * p[0] * t;
        for (j, column) in columns.iter_mut().enumerate() {
            let basis = (std::f64::consts::PI * j as f64 * t).cos();
            model += p[j] * basis;
            column.push(basis + if j == 0 { 2.0 * p[0] * t } else { 0.0 });
        }
        r.push(model - (3.0 * t).sin() - 0.5 * t * t);
    }
    let mut normal = Normal::zeros(UNKNOWN);
    if !whole {
        normal.cost = r.iter().map(|r| r * r).sum();
        return normal;
    }
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    normal.add(&r, &columns);
    normal
}

fn ours() -> Vec<f64> {
    let bounds = [(-100.0, 100.0); UNKNOWN];
    nls::minimise(&[0.1; UNKNOWN], &bounds, normal, &nls::Options::default()).values
}

/// Without damping, scaling, bounds or a rank test.
fn naive() -> Vec<f64> {
    let mut p = vec![0.1; UNKNOWN];
    let mut cost = f64::INFINITY;
    for _ in 0..50 {
        let n = normal(&p, true);
        if (cost - n.cost).abs() <= 1e-12 * n.cost {
            break;
        }
        cost = n.cost;
        let matrix = DMatrix::from_fn(UNKNOWN, UNKNOWN, |i, j| n.matrix[(i, j)]);
        let Some(step) = matrix.lu().solve(&DVector::from_vec(n.gradient)) else { break };
        for (p, s) in p.iter_mut().zip(step.iter()) {
            *p -= s;
        }
    }
    p
}

fn solve(c: &mut Criterion) {
    let (a, b) = (ours(), naive());
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-4 * (1.0 + b.abs())), "they differ: {a:?} {b:?}");
    let mut group = c.benchmark_group("least squares");
    group.sample_size(20);
    group.bench_function("Levenberg–Marquardt on faer", |b| b.iter(|| black_box(ours())));
    group.bench_function("Gauss–Newton on nalgebra's LU", |b| b.iter(|| black_box(naive())));
    group.finish();
    ratio::ratio(
        "Levenberg–Marquardt on faer",
        "Gauss–Newton on nalgebra's LU",
        || drop(black_box(ours())),
        || {
            drop(black_box(naive()));
        },
    );
}

criterion_group!(benches, solve);
criterion_main!(benches);
