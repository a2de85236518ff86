//! What limits a log: told right on set-ups of five kinds? Does the floor lie where the true model's error does?

use crate::{
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{
    Axis, Record,
    diagnosis::LimitedBy,
    effects::Stage,
    fit::FitError,
    simulate::{Coloured, Motion, Reference, Scenario, SensorSpec, SetUp, Simulator},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs of each kind.
    #[arg(long, default_value_t = 8)]
    logs: u64,
}

/// A set-up as people have it.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Cameras: an orientation with noise at 5 to 70 Hz.
    Cameras,
    /// A robot's controller: some ten values a second, straight lines between.
    Controller,
    /// Another gyro beside the first, noisier.
    SecondSensor,
    /// Wheels: a shaft's angle through a slow filter.
    Wheels,
    /// A radio link: stamps that scatter.
    Radio,
}

const KINDS: [(&str, Kind); 5] = [
    ("cameras", Kind::Cameras),
    ("controller", Kind::Controller),
    ("second-sensor", Kind::SecondSensor),
    ("wheels", Kind::Wheels),
    ("radio", Kind::Radio),
];

impl Kind {
    /// The part that has to be told.
    const fn limit(self) -> LimitedBy {
        match self {
            Self::Cameras | Self::SecondSensor => LimitedBy::ReferenceNoise,
            Self::Controller | Self::Wheels => LimitedBy::ReferenceBandwidth,
            Self::Radio => LimitedBy::Timing,
        }
    }

    fn drawn(self, seed: u64) -> (Scenario, SetUp) {
        let random = &mut ChaCha8Rng::seed_from_u64(seed ^ 0xb0d6);
        let mut sensor = SensorSpec { reference_every: 1, ..SensorSpec::random(seed) };
        let plain = SetUp::default();
        let motion = if random.random_bool(0.5) {
            Motion::Multisine { travel: random.random_range(4.0..10.0) }
        } else {
            Motion::Drive { rate: random.random_range(1.0..2.5), hold: random.random_range(0.8..2.0) }
        };
        let (rate_hz, set_up) = match self {
            Self::Cameras => {
                sensor.reference = Reference::Quaternion;
                let noise = Coloured {
                    size: random.random_range(1e-4..6e-4),
                    low: random.random_range(2.0..10.0),
                    high: random.random_range(30.0..70.0),
                };
                (200.0, SetUp { noise: Some(noise), ..plain })
            }
            Self::Controller => {
                sensor.reference = Reference::Encoder(0);
                (100.0, SetUp { reference_rate: random.random_range(8.0..16.0), ..plain })
            }
            Self::SecondSensor => {
                sensor.reference = Reference::Rate;
                let size = random.random_range(2.0..6.0) * sensor.noise_density * 50_f64.sqrt();
                (100.0, SetUp { noise: Some(Coloured { size, low: 0.0, high: f64::INFINITY }), ..plain })
            }
            Self::Wheels => {
                sensor.reference = Reference::Encoder(0);
                (100.0, SetUp { smoothing: random.random_range(0.02..0.05), ..plain })
            }
            Self::Radio => {
                sensor.reference = Reference::Encoder(0);
                (100.0, SetUp { jitter: random.random_range(1e-3..4e-3), ..plain })
            }
        };
        (Scenario { motion, seed, rate_hz, seconds: 60.0, sensor, ..Scenario::default() }, set_up)
    }
}

/// One log.
struct End {
    kind: Kind,
    told: Option<LimitedBy>,
    unattributed: f64,
    /// Effects that are not there.
    invented: Vec<String>,
    /// Least and largest error over floor from four samples to a thirtieth of the log.
    over: (f64, f64),
    /// Whether all of them are within [`NEAR`] or within two standard deviations of what one log of noise alone has.
    is_near_or_chance: bool,
}

/// ln of the ratio of an error to its floor that is near.
const NEAR: f64 = 0.14;
/// Standard deviations at which the band of 99 % ends.
const BAND: f64 = 3.1;

/// Runs it and prints the shares.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let trials = KINDS.iter().flat_map(|(name, kind)| {
        (0..arguments.logs).map(move |k| Trial { name: format!("{name}/{k}"), what: (*kind, run.seed_of(k)) })
    });
    let ends = run.each(trials.collect(), |trial, detail| {
        let (kind, seed) = trial.what;
        let (scenario, set_up) = kind.drawn(seed);
        let axis = scenario.sensor.axis;
        let count = (scenario.seconds * scenario.rate_hz) as usize;
        let samples: Vec<_> = Simulator::new(&scenario).take(count).collect();
        let rows = set_up.applied(&samples, axis, scenario.rate_hz, seed);
        let record = Record { rows, ..Record::default() };
        let outcome = Outcome::of(&record, axis, detail)?;
        if detail {
            tell(&outcome, axis);
        }
        let curve = outcome.ladder.steps.last().map(|step| step.error_curve.clone()).unwrap_or_default();
        let middle = |tau: f64| tau >= 3.9 / scenario.rate_hz && tau <= scenario.seconds / 30.0;
        let over: Vec<f64> =
            curve.iter().filter(|p| middle(p.tau_s)).filter_map(|p| Some(p.error? / p.floor?)).collect();
        let is_near_or_chance = curve.iter().filter(|p| middle(p.tau_s)).all(|p| {
            let ln = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(f64::NAN, |(a, b)| (a / b).ln());
            ln(p.error, p.floor).abs() < NEAR.max(2.0 / BAND * ln(p.floor_99, p.floor))
        });
        let budget: Vec<f64> = outcome
            .ladder
            .budget
            .iter()
            .filter(|p| middle(p.tau_s))
            .map(|p| p.share(LimitedBy::Unattributed))
            .collect();
        // A smoothed reference is an effect of its own: named, it limits nothing any more.
        let is_there =
            |stage: Stage| stage == Stage::Calibration || matches!(kind, Kind::Wheels) && stage == Stage::Shown;
        let known = |id: &str| gyro_model::effects::find(id).is_some_and(|effect| is_there(effect.stage()));
        let smoothing = outcome.added.iter().any(|added| added.id == "reference-smoothing");
        Ok(End {
            kind,
            told: if smoothing && matches!(kind, Kind::Wheels) {
                Some(LimitedBy::ReferenceBandwidth)
            } else {
                outcome.ladder.limited_by
            },
            unattributed: budget.iter().sum::<f64>() / budget.len().max(1) as f64,
            invented: outcome.added.iter().map(|added| added.id.clone()).filter(|id| !known(id)).collect(),
            over: over.iter().fold((f64::INFINITY, 0.0), |(low, high), ratio| (low.min(*ratio), high.max(*ratio))),
            is_near_or_chance,
        })
    })?;
    let head = [
        "set-up",
        "limit told right",
        "floor within 15 % of the error",
        "or within 2 standard deviations",
        "unattributed, mean",
        "logs with something invented",
    ];
    let mut table = Table::new(&head);
    let mut add = |name: &str, ends: &[&End]| {
        let count = |test: &dyn Fn(&End) -> bool| share(ends.iter().filter(|end| test(end)).count(), ends.len());
        let mean = ends.iter().map(|end| end.unattributed).sum::<f64>() / ends.len().max(1) as f64;
        table.row([
            format!("{name}: {}", ends.len()),
            count(&|end| end.told == Some(end.kind.limit())),
            count(&|end| end.over.0 > 1.0 / 1.15 && end.over.1 < 1.15),
            count(&|end| end.is_near_or_chance),
            format!("{:.0} %", 100.0 * mean),
            count(&|end| !end.invented.is_empty()),
        ]);
    };
    for (name, _) in KINDS {
        let own: Vec<&End> =
            ends.iter().filter(|(trial, _)| trial.name.starts_with(name)).map(|(_, end)| end).collect();
        if !own.is_empty() {
            add(name, &own);
        }
    }
    add("all", &ends.iter().map(|(_, end)| end).collect::<Vec<_>>());
    table.print();
    for (trial, end) in &ends {
        let right = end.told == Some(end.kind.limit()) && end.invented.is_empty();
        if !right || end.over.1 >= 1.15 || end.over.0 <= 1.0 / 1.15 {
            println!(
                "- `--only {}`: told {}, error {:.2} to {:.2} of the floor, invented {:?}",
                trial.name,
                end.told.map_or("nothing", LimitedBy::words),
                end.over.0,
                end.over.1,
                end.invented
            );
        }
    }
    Ok(())
}

/// The budget of a single log, to standard error.
fn tell(outcome: &Outcome, axis: Axis) {
    eprintln!("  {axis}: {}", outcome.ladder.limited_says);
    for point in outcome.ladder.steps.last().iter().flat_map(|step| &step.error_curve) {
        let (error, floor) = (point.error.unwrap_or(f64::NAN), point.floor.unwrap_or(f64::NAN));
        eprintln!("  {:8.3} s: {:.3e} rad/s, {:.2} of the floor", point.tau_s, error, error / floor);
    }
    for point in &outcome.ladder.budget {
        let shares = point.parts.map(|part| format!("{:4.0}", 100.0 * part / point.total()));
        eprintln!("  {:8.3} s: {} %", point.tau_s, shares.join(" "));
    }
}
