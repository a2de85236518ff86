//! One step of the Kalman filter and of the whole estimator.

#![allow(missing_docs)] // criterion_group! makes public functions

mod ratio;

use criterion::{Criterion, criterion_group, criterion_main};
use gyro_model::{
    Axis, AxisModel, Model, Row, Term,
    effects::{CATALOGUE, Stage},
    estimator::{Estimator, Options},
    kalman::{Calibration, Drive, Filter, Measured},
};
use nalgebra::{DMatrix, DVector};
use std::hint::black_box;

const DT: f64 = 1e-3;
const R: f64 = 1e-6;
const DRIVE: Drive = Drive { jerk: 1e3, bias_random_walk: 1e-5 };

/// The same filter as it is written without knowing its size: every product allocates.
struct Dynamic {
    x: DVector<f64>,
    p: DMatrix<f64>,
}

impl Dynamic {
    fn new() -> Self {
        Self { x: DVector::zeros(4), p: DMatrix::identity(4, 4) }
    }

    fn step(&mut self, z: f64) -> f64 {
        let dt = DT;
        #[rustfmt::skip]
        let f = DMatrix::from_row_slice(4, 4, &[
            1.0, dt, dt * dt / 2.0, 0.0,
            0.0, 1.0, dt, 0.0,
            0.0, 0.0, 1.0, 0.0,
            0.0, 0.0, 0.0, 1.0,
        ]);
        let q = DMatrix::from_diagonal(&DVector::from_vec(vec![0.0, 0.0, DRIVE.jerk * dt, 1e-10 * dt]));
        self.x = &f * &self.x;
        self.p = &f * &self.p * f.transpose() + q;
        let h = DMatrix::from_row_slice(1, 4, &[0.0, 1.0, 0.0, 1.0]);
        let s = (&h * &self.p * h.transpose())[0] + R;
        let k = &self.p * h.transpose() / s;
        let nu = z - (&h * &self.x)[0];
        self.x += &k * nu;
        let a = DMatrix::identity(4, 4) - &k * &h;
        self.p = &a * &self.p * a.transpose() + &k * R * k.transpose();
        self.x[1]
    }
}

/// A motion's reading.
fn reading(k: &mut u32) -> f64 {
    *k = (*k + 1) % 4000;
    (f64::from(*k) * std::f64::consts::TAU / 4000.0).sin()
}

/// A model of three axes: the base, or everything in the catalogue at once.
fn model(full: bool) -> Model {
    let mut model = Model { epoch: 1, ..Model::default() };
    for axis in Axis::ALL {
        let mut terms = AxisModel::base(axis);
        terms.noise.angle_random_walk = 1e-4;
        terms.noise.encoder = 4e-4;
        for effect in CATALOGUE.iter().filter(|e| full && e.stage() != Stage::Calibration) {
            let mut term = Term::neutral(*effect, axis);
            term.values = effect.parameters(axis).iter().map(|p| p.typical).collect();
            terms.terms.push(term);
        }
        model.axes[axis.index()] = Some(terms);
    }
    model
}

/// An estimator and rows for it.
fn estimator(full: bool) -> impl FnMut() {
    let mut estimator = Estimator::new(Options::default());
    estimator.set_model(&model(full));
    let (mut k, mut t_ns) = (0, 0);
    move || {
        t_ns += 1_000_000;
        let rate = reading(&mut k);
        let row = Row {
            t_ns,
            gyro: [rate, 0.5 * rate, 0.1],
            ref_angle: [rate, f64::NAN, f64::NAN],
            accel: [0.0, 0.0, 9.8],
            temperature: 30.0,
            supply: 3.3,
            ..Row::EMPTY
        };
        black_box(estimator.step(&row));
    }
}

fn kalman() -> impl FnMut() {
    let (mut filter, mut k) = (Filter::new(0.0, R, Calibration { bias_std: 0.01, scale_std: 1e-3, delay_std: 0.0 }), 0);
    move || {
        filter.predict(DT, &DRIVE);
        black_box(filter.update(Measured::Gyro, reading(&mut k), R));
    }
}

fn dynamic() -> impl FnMut() {
    let (mut filter, mut k) = (Dynamic::new(), 0);
    move || {
        black_box(filter.step(reading(&mut k)));
    }
}

fn steps(c: &mut Criterion) {
    let mut group = c.benchmark_group("filter");
    group.bench_function("kalman step, one axis", |b| b.iter(kalman()));
    group.bench_function("the same with matrices of unknown size", |b| b.iter(dynamic()));
    group.bench_function("estimator step, three axes, base model", |b| b.iter(estimator(false)));
    group.bench_function("estimator step, three axes, whole catalogue", |b| b.iter(estimator(true)));
    group.finish();
    ratio::ratio("kalman step", "matrices of unknown size", kalman(), dynamic());
    ratio::ratio("estimator with the whole catalogue", "base model", estimator(true), estimator(false));
}

criterion_group!(benches, steps);
criterion_main!(benches);
