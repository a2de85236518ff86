//! Whole logs with one kind of fault each, up the ladder: the fault is named, no effect is made of what it leaves, and the scale
//! factor is as right as on the clean log.

use gyro_model::{
    Axis, Model, Record,
    diagnose::{self, Options},
    diagnosis::{AxisResult, DataFault, Verdict},
    faults,
    simulate::{Hidden, Motion, Reference, Scenario, SensorSpec, SetUp, Simulator, simulate},
    words::Voice,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// The end of the range of 2000 °/s, rad/s.
const FULL: f64 = 34.9;

fn shaft(seed: u64) -> Record {
    let motion = Motion::Multisine { travel: 6.0 };
    simulate(&Scenario { motion, seconds: 60.0, rate_hz: 200.0, seed, ..Scenario::default() }).record
}

fn body(seed: u64) -> Record {
    let sensor = SensorSpec { reference: Reference::Quaternion, reference_noise: 5e-4, ..SensorSpec::default() };
    let motion = Motion::Multisine { travel: 6.0 };
    simulate(&Scenario { motion, seconds: 60.0, seed, sensor, ..Scenario::default() }).record
}

struct Climbed {
    faults: Vec<DataFault>,
    ladders: Vec<AxisResult>,
}

fn climb(mut record: Record) -> Climbed {
    let faults = faults::check(&mut record, &[]).faults;
    let options = Options { faults: &faults, ..Options::default() };
    let axes = record.fitted_axes();
    let (_, ladders) = diagnose::ladder(&record, &Model::base_for(&record), &axes, &options).unwrap();
    Climbed { faults, ladders }
}

impl Climbed {
    fn names(&self) -> Vec<&str> {
        self.faults.iter().map(|fault| fault.kind.name()).collect()
    }

    fn alpha(&self, axis: Axis) -> f64 {
        let own = self.ladders.iter().find(|ladder| ladder.axis == axis).unwrap();
        own.parameters.iter().find(|p| p.effect == "scale-factor").and_then(|p| p.value).unwrap()
    }

    /// This one fault, nothing missing, and the clean log's α on every axis, within a part in so many.
    fn is_only(&self, name: &str, clean: &Self, part: f64) {
        assert_eq!(self.names(), [name], "{:?}", self.faults);
        for own in &self.ladders {
            assert_eq!(own.verdict, Verdict::Adequate, "{name}, axis {}: {}", own.axis, own.in_words(Voice::Log));
            assert_eq!(own.effects, ["scale-factor", "bias"], "{name}, axis {}", own.axis);
            let (alpha, right) = (self.alpha(own.axis), clean.alpha(own.axis));
            assert!((alpha / right - 1.0).abs() < part, "{name}, axis {}: α {alpha} for {right}", own.axis);
        }
    }
}

/// Every so many rows, at irregular distances.
fn now_and_then(rows: usize, every: usize) -> impl Iterator<Item = usize> {
    (0..rows / every).map(move |i| i * every + (i * 7919 + 13) % every)
}

#[test]
fn faults_of_a_gyro_leave_the_clean_log() {
    let clean = climb(shaft(1));
    assert!(clean.faults.is_empty(), "{:?}", clean.faults);
    let spoilt = |spoil: &dyn Fn(&mut Record)| {
        let mut record = shaft(1);
        spoil(&mut record);
        climb(record)
    };
    let spikes = spoilt(&|record| {
        now_and_then(record.len(), 500).zip(1_i32..).for_each(|(k, i)| {
            record.rows[k].gyro[0] += 0.1 * f64::from(1 + i % 4) * if i % 3 == 0 { -1.0 } else { 1.0 };
        });
    });
    spikes.is_only("outliers", &clean, 1e-4);
    let marked = spoilt(&|record| {
        record.rows[..30].iter_mut().for_each(|row| row.gyro[0] = -FULL);
        now_and_then(record.len(), 400).for_each(|k| record.rows[k].gyro[0] = -FULL);
    });
    marked.is_only("markers", &clean, 1e-4);
    let zeros = spoilt(&|record| {
        let turns = |k: &usize| record.rows[*k].gyro[0].abs() > 0.3;
        let at: Vec<usize> = now_and_then(record.len(), 200).filter(turns).collect();
        for k in at {
            record.rows[k].gyro[0] = 0.0;
        }
    });
    zeros.is_only("markers", &clean, 1e-4);
    let step = SensorSpec::default().quantum;
    let torn = spoilt(&|record| {
        let counts: Vec<i64> = record.rows.iter().map(|row| (row.gyro[0] / step).round() as i64).collect();
        for k in now_and_then(record.len(), 12).filter(|k| *k > 0) {
            let word = counts[k - 1].div_euclid(256) * 256 + counts[k].rem_euclid(256);
            record.rows[k].gyro[0] = word as f64 * step;
        }
    });
    torn.is_only("torn-readings", &clean, 1e-4);
    let wrapped = spoilt(&|record| {
        let most = record.rows.iter().map(|row| row.gyro[0].abs()).fold(0.0, f64::max);
        let range = 0.8 * most;
        record.rows.iter_mut().for_each(|row| row.gyro[0] = (row.gyro[0] + range).rem_euclid(2.0 * range) - range);
    });
    wrapped.is_only("wrapped", &clean, 3e-4);
}

#[test]
fn faults_of_a_shafts_reference_leave_the_clean_log() {
    let clean = climb(shaft(2));
    let spoilt = |spoil: &dyn Fn(&mut Record)| {
        let mut record = shaft(2);
        spoil(&mut record);
        climb(record)
    };
    let half_turns = spoilt(&|record| {
        for (i, from) in now_and_then(record.len() - 400, 1500).enumerate() {
            record.rows[from..from + 3 + 30 * i].iter_mut().for_each(|row| row.ref_angle[0] += std::f64::consts::PI);
        }
    });
    half_turns.is_only("reference-jumps", &clean, 1e-4);
    let slipped = spoilt(&|record| {
        record.rows[5000..].iter_mut().for_each(|row| row.ref_angle[0] += 0.4);
        record.rows[9000..].iter_mut().for_each(|row| row.ref_angle[0] -= 0.7);
    });
    slipped.is_only("reference-jumps", &clean, 2e-4);
    let spikes = spoilt(&|record| {
        now_and_then(record.len(), 300).for_each(|k| record.rows[k].ref_angle[0] = 17.0);
    });
    spikes.is_only("markers", &clean, 1e-4);
}

#[test]
fn spans_in_which_markers_changed_places_are_left_out_of_an_orientation() {
    let clean = climb(body(3));
    assert!(clean.faults.is_empty(), "{:?}", clean.faults);
    let turn = UnitQuaternion::from_scaled_axis(2.1 * Vector3::new(0.6, 0.8, 0.0));
    let turned = |row: &mut gyro_model::Row, by: &dyn Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>| {
        let [w, x, y, z] = row.ref_quaternion;
        let q = by(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))).into_inner();
        row.ref_quaternion = [q.w, q.i, q.j, q.k];
    };
    let mut swapped = body(3);
    for (i, from) in now_and_then(swapped.len() - 50, 450).enumerate() {
        swapped.rows[from..from + 1 + 3 * i].iter_mut().for_each(|row| turned(row, &|q| q * turn));
    }
    climb(swapped).is_only("reference-jumps", &clean, 1e-3);
    let mut anew = body(3);
    anew.rows[2500..].iter_mut().for_each(|row| turned(row, &|q| turn * q));
    climb(anew).is_only("reference-jumps", &clean, 1e-3);
}

#[test]
fn a_ratio_that_no_gyro_has_is_said() {
    let mut geared = shaft(4);
    geared.rows.iter_mut().for_each(|row| row.ref_angle[0] *= 1.25);
    let geared = climb(geared);
    let told = &geared.ladders[0].data_faults;
    assert!(told.len() == 1 && told[0].kind.name() == "wrong-ratio" && told[0].says.contains("5 : 4"), "{told:?}");
    assert!(
        geared.ladders[0].in_words(Voice::Log).contains("gear ratio"),
        "{}",
        geared.ladders[0].in_words(Voice::Log)
    );
}

/// Counts that an encoder loses are a suspect beside a gyro that bends, and a fault of the data once they are named.
#[test]
fn lost_counts_are_no_nonlinearity_and_a_nonlinearity_loses_no_counts() {
    counts_are_lost(&[(0.06, 0)]);
    let bent = climb(with("cubic-nonlinearity:k3=0.0005"));
    assert_eq!(bent.ladders[0].effects[2], "cubic-nonlinearity", "{}", bent.ladders[0].in_words(Voice::Log));
    assert!(bent.ladders[0].data_faults.is_empty(), "{:?}", bent.ladders[0].data_faults);
}

#[test]
#[ignore = "long: tests/nightly"]
fn few_and_many_lost_counts_are_found() {
    counts_are_lost(&[(0.005, 0), (0.3, 1)]);
}

fn counts_are_lost(shares: &[(f64, u8)]) {
    for &(share, beyond) in shares {
        let lossy = climb(with(&format!("lost-counts:loss={share},above=2.5,beyond={beyond}")));
        let own = &lossy.ladders[0];
        let says = own.in_words(Voice::Log);
        assert_eq!(own.effects, ["scale-factor", "bias", "lost-counts"], "{share}: {says}");
        let value = |name: &str| own.parameters.iter().find(|p| p.name == name).and_then(|p| p.value).unwrap();
        assert!((value("loss") / share - 1.0).abs() < 0.1, "{} for {share}", value("loss"));
        assert!((value("above") / 2.5 - 1.0).abs() < 0.05, "{}", value("above"));
        assert!((lossy.alpha(Axis::X) / SensorSpec::default().alpha - 1.0).abs() < 1e-3, "{}", lossy.alpha(Axis::X));
        let fault = own.data_faults.iter().find(|fault| fault.kind.name() == "lost-counts").expect(&says);
        assert!(fault.count > 500 && fault.says.contains("count in hardware"), "{fault:?}");
    }
}

#[test]
fn what_an_effect_does_to_the_ratio_is_no_fault_of_the_reference() {
    for record in [with("temperature-bias:c1=0.06"), with("lag:tau=0.05"), with("saturation:l=1.2")] {
        let climbed = climb(record);
        let own = &climbed.ladders[0];
        assert!(
            own.data_faults.iter().all(|fault| fault.kind.name() != "wrong-ratio"),
            "{:?}: {}",
            own.effects,
            own.in_words(Voice::Log)
        );
    }
}

fn with(hidden: &str) -> Record {
    let hidden = vec![Hidden::parse(hidden, Axis::X).unwrap()];
    let motion = Motion::Multisine { travel: 6.0 };
    simulate(&Scenario { motion, seconds: 60.0, rate_hz: 200.0, hidden, ..Scenario::default() }).record
}

#[test]
fn stamps_in_bursts_are_bad_data_and_no_effect() {
    let mut record = shaft(5);
    for (k, row) in (0_i64..).zip(&mut record.rows) {
        row.t_ns = (k / 8 * 8 + 7) * 5_000_000 + k % 8 * 150_000;
    }
    let burst = climb(record);
    assert_eq!(burst.names(), ["burst-timestamps"], "{:?}", burst.faults);
    assert_eq!((burst.ladders[0].verdict, burst.ladders[0].effects.len()), (Verdict::BadData, 2));
}

#[test]
fn a_gyro_that_is_wired_the_wrong_way_round_does_not_take_the_others_along() {
    let mut record = body(6);
    record.rows.iter_mut().for_each(|row| row.gyro[1] *= -1.0);
    let climbed = climb(record);
    let clean = climb(body(6));
    for own in &climbed.ladders {
        let is_bad = own.axis == Axis::Y;
        assert_eq!(
            own.verdict,
            if is_bad { Verdict::BadData } else { Verdict::Adequate },
            "axis {}: {}",
            own.axis,
            own.in_words(Voice::Log)
        );
        assert!(own.in_words(Voice::Log).contains("without"), "{}", own.in_words(Voice::Log));
        if !is_bad {
            let (alpha, right) = (climbed.alpha(own.axis), clean.alpha(own.axis));
            assert!((alpha / right - 1.0).abs() < 2e-3, "axis {}: α {alpha} for {right}", own.axis);
        }
    }
}

#[test]
fn what_looks_like_a_fault_and_is_physics_is_still_found() {
    for text in ["saturation:l=1.2", "dead-zone:w=0.1", "vibration-tone", "bias-step:j=-0.07", "encoder-backlash"] {
        let hidden = vec![Hidden::parse(text, Axis::X).unwrap()];
        let motion = Motion::Multisine { travel: 6.0 };
        let record = simulate(&Scenario { motion, seconds: 60.0, hidden, ..Scenario::default() }).record;
        let climbed = climb(record);
        assert!(climbed.faults.is_empty(), "{text}: {:?}", climbed.faults);
        let id = text.split(':').next().unwrap();
        assert!(
            climbed.ladders[0].effects.iter().any(|effect| effect == id),
            "{text}: {:?}",
            climbed.ladders[0].effects
        );
    }
}

/// Torque ripple that is 80 Hz fast at the fastest turns, at 100 rows a second; the rate at which it is told says where it truly is.
#[test]
#[ignore = "long: tests/nightly"]
fn motion_that_is_folded_is_told_with_its_true_frequency_and_no_tone_is_made_of_it() {
    let sensor = SensorSpec { reference: Reference::Encoder(0), ..SensorSpec::default() };
    let motion = Motion::RateTable { rate: 2.0, hold: 15.0 };
    let scenario = Scenario { motion, seconds: 240.0, seed: 5, sensor, ..Scenario::default() };
    let samples: Vec<_> = Simulator::new(&scenario).take(24_000).collect();
    let fastest = samples.iter().map(|s| s.true_rate[0].abs()).fold(0.0, f64::max).to_degrees();
    let rows = SetUp { fold: 80.0, ..SetUp::default() }.applied(&samples, Axis::X, 100.0, 5);
    let climbed = climb(Record { rows, ..Record::default() });
    let ladder = &climbed.ladders[0];
    assert!(!ladder.effects.iter().any(|id| id == "vibration-tone"), "{:?}", ladder.effects);
    let fault = ladder
        .data_faults
        .iter()
        .find(|fault| fault.kind.name() == "aliased-motion")
        .unwrap_or_else(|| panic!("{}", ladder.in_words(Voice::Log)));
    let before = |unit: &str| -> f64 {
        let text = fault.says.split(unit).next().unwrap();
        text.rsplit(' ').find(|word| !word.is_empty()).unwrap().parse().unwrap()
    };
    let (truly, rate) = (before(" Hz"), before(" °/s"));
    assert!((truly - 80.0 * rate / fastest).abs() < 3.0, "at {rate} of {fastest} °/s: {}", fault.says);
}
