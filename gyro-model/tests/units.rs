//! Logs made by formula, of gyros whose scale is far from one and of references of every kind: what is fitted, what the
//! floor is made of and what the compensation does have to be in the same units.

use gyro_model::{
    Axis, Model, Record, Row, Term,
    compensation::Compensation,
    diagnose::{self, Options},
    effects::find,
    fit::fit,
};
use nalgebra::{UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

const RATE_HZ: f64 = 100.0;
const ROWS: usize = 9000;

/// How a log is made: ω = α g + δ + m ω of the next axis, white noise on each reading.
#[derive(Clone, Copy)]
struct Maker {
    alpha: f64,
    cross: f64,
    gyro_noise: f64,
    reference_noise: f64,
    reference: Reference,
}

#[derive(Clone, Copy, PartialEq)]
enum Reference {
    Angles,
    Rates,
    Orientation,
}

const PLAIN: Maker =
    Maker { alpha: 1.0, cross: 0.0, gyro_noise: 1e-3, reference_noise: 1e-6, reference: Reference::Angles };
const DELTA: [f64; 3] = [0.02, -0.03, 0.01];

/// Angle and rate about each axis.
fn motion(axis: usize, t: f64) -> (f64, f64) {
    let lines = [[(0.6, 0.21), (0.3, 0.47)], [(0.5, 0.33), (0.3, 0.61)], [(0.7, 0.13), (0.2, 0.53)]][axis];
    lines.iter().fold((0.0, 0.0), |(angle, rate), &(size, f)| {
        let phase = TAU * f * t + axis as f64;
        (angle - size / (TAU * f) * phase.cos(), rate + size * phase.sin())
    })
}

impl Maker {
    fn record(self) -> Record {
        let mut normals = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut normals) };
        let mut attitude = UnitQuaternion::identity();
        let rows = (0..ROWS).map(|k| {
            let t = k as f64 / RATE_HZ;
            let mut row = Row { t_ns: (t * 1e9).round() as i64, ..Row::EMPTY };
            for (i, delta) in DELTA.into_iter().enumerate() {
                let (angle, rate) = motion(i, t);
                let next = motion((i + 1) % 3, t).1;
                row.gyro[i] = (rate - delta - self.cross * next) / self.alpha + self.gyro_noise * normal();
                match self.reference {
                    Reference::Angles => row.ref_angle[i] = angle + self.reference_noise * normal(),
                    Reference::Rates => row.ref_rate[i] = rate + self.reference_noise * normal(),
                    Reference::Orientation => {}
                }
            }
            if self.reference == Reference::Orientation {
                let noise = Vector3::from_fn(|_, _| self.reference_noise * normal());
                let read = attitude * UnitQuaternion::from_scaled_axis(noise);
                row.ref_quaternion = [read.w, read.i, read.j, read.k];
                for part in 0..10 {
                    let at = t + (f64::from(part) + 0.5) / 10.0 / RATE_HZ;
                    let step = Vector3::from_fn(|i, _| motion(i, at).1) / 10.0 / RATE_HZ;
                    attitude *= UnitQuaternion::from_scaled_axis(step);
                }
            }
            row
        });
        Record { rows: rows.collect(), ..Record::default() }
    }
}

/// The largest error over the floor of the fitted base model on each axis, and the model.
fn fitted(record: &Record, axes: &[Axis]) -> (Vec<f64>, Model) {
    let model = fit(record, &Model::base_for(record), axes).unwrap();
    let options = Options { own_log: true, ..Options::default() };
    let judged = diagnose::compare(record, &model, axes, &options).unwrap();
    (judged.iter().map(|axis| axis.error_over_floor.unwrap()).collect(), model)
}

#[test]
fn the_floor_of_a_gyro_has_its_scale() {
    for alpha in [0.4, 1.0, 2.156] {
        let (over, model) = fitted(&Maker { alpha, ..PLAIN }.record(), &Axis::ALL);
        assert!(over.iter().all(|over| (0.85..1.4).contains(over)), "α = {alpha}: {over:?}");
        for axis in model.axes.iter().flatten() {
            let true_walk = alpha * PLAIN.gyro_noise / RATE_HZ.sqrt();
            let found = axis.noise.angle_random_walk / true_walk;
            assert!((0.8..1.25).contains(&found), "α = {alpha}: N is {found} times the true one");
        }
    }
}

#[test]
fn the_noise_of_a_reference_that_is_a_rate_is_in_the_floor() {
    for gyro_noise in [1e-4, 1e-3] {
        let maker = Maker { gyro_noise, reference_noise: 1e-3, reference: Reference::Rates, ..PLAIN };
        let (over, _) = fitted(&maker.record(), &Axis::ALL);
        assert!(over.iter().all(|over| (0.8..1.6).contains(over)), "gyro noise {gyro_noise}: {over:?}");
    }
}

#[test]
fn an_axis_sees_the_others_as_they_are_compensated() {
    for reference in [Reference::Angles, Reference::Rates] {
        let maker = Maker { alpha: 2.156, cross: 0.05, reference, reference_noise: 1e-4, ..PLAIN };
        let record = maker.record();
        let mut model = Model::base_for(&record);
        for axis in Axis::ALL {
            let cross = Term::neutral(find("cross-axis").unwrap(), axis);
            model.axes[axis.index()].as_mut().unwrap().terms.push(cross);
        }
        let model = fit(&record, &model, &Axis::ALL).unwrap();
        let mut compensation = Compensation::new(&model);
        let mut squares = [0.0; 3];
        for row in &record.rows {
            let t = row.t_ns as f64 * 1e-9;
            let angle = [0, 1, 2].map(|i| motion(i, t).0);
            for (i, compensated) in compensation.step(row, angle).into_iter().enumerate() {
                squares[i] += (compensated.unwrap().rate - motion(i, t).1).powi(2) / ROWS as f64;
            }
        }
        let noise = maker.alpha * maker.gyro_noise;
        assert!(squares.iter().all(|square| square.sqrt() < 1.3 * noise), "{squares:?}, noise {noise}");
    }
}

#[test]
fn what_turns_about_an_axis_without_a_gyro_is_no_error() {
    let maker = Maker { reference: Reference::Orientation, reference_noise: 1e-3, ..PLAIN };
    let whole = maker.record();
    for gyros in [&[Axis::Z][..], &[Axis::X, Axis::Y], &Axis::ALL] {
        let mut record = whole.clone();
        for row in &mut record.rows {
            for axis in Axis::ALL.iter().filter(|axis| !gyros.contains(axis)) {
                row.gyro[axis.index()] = f64::NAN;
            }
        }
        for (record, what) in [(&record, "not there"), (&whole, "not asked about")] {
            let (over, model) = fitted(record, gyros);
            assert!(over.iter().all(|over| *over < 1.4), "{gyros:?}, others {what}: {over:?}");
            for axis in gyros {
                let own = model.axes[axis.index()].as_ref().unwrap();
                let (alpha, std_error) = (own.alpha(), own.term("scale-factor").unwrap().std_errors[0]);
                assert!((alpha - 1.0).abs() < 5.0 * std_error && std_error < 1e-3, "{axis}: {alpha} ± {std_error}");
            }
        }
    }
}
