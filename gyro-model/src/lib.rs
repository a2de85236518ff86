//! The mathematics of truerate: what a gyro's reading means, which physical effects spoil it, how to find and undo them.
//!
//! Nothing in this crate reads a clock, a file or a socket, and nothing logs: it turns numbers into numbers, so that a
//! vehicle in motion and a log on a desk go through the same code.
//!
//! Sensor-error form, one line an axis, SI units (rad, rad/s, m/s², s, °C, V):
//!
//! ```text
//! felt rate      ω_f = ω + Σ_j β_j φ_j(ω, …; η_j)
//! reading        ω_g = (ω_f − δ)/α + noise
//! compensation   ω̂   = α ω_g + δ − Σ_j β_j φ_j(ω̂, …; η_j)
//! encoder        θ_e = θ + Σ_j κ_j ψ_j(θ; η_j) + noise
//! ```
//!
//! # Which effect is missing
//!
//! A log is a [`Record`]: rows of readings with a reference beside them. Here it is simulated, 60 s of a gyro that is 12 ms late.
//!
//! ```
//! use gyro_model::{Axis, Model, diagnose::{Options, diagnose}, simulate::{Hidden, Scenario, simulate}};
//!
//! let late = Hidden::parse("delay:d=0.012", Axis::X).expect("an effect of the catalogue with its parameter");
//! let log = simulate(&Scenario { hidden: vec![late], ..Scenario::default() }).record;
//!
//! let found = diagnose(&log, &Model::base_for(&log), &[Axis::X], &Options::default())?;
//! let best = &found[0].suspects[0];
//! assert_eq!(best.effect, "delay");
//! assert!(best.parameters[0].value.is_some_and(|d| (d - 0.012).abs() < 1e-3));
//! # Ok::<(), gyro_model::fit::FitError>(())
//! ```
//!
//! # Add until nothing is missing, and say so
//!
//! ```
//! # use gyro_model::{Axis, Model, diagnose::{Options, ladder}, headline, simulate::{Hidden, Scenario, simulate}, words::Voice};
//! # let late = Hidden::parse("delay:d=0.012", Axis::X).expect("an effect of the catalogue with its parameter");
//! # let log = simulate(&Scenario { hidden: vec![late], ..Scenario::default() }).record;
//! let (model, axes) = ladder(&log, &Model::base_for(&log), &[Axis::X], &Options::default())?;
//! assert_eq!(axes[0].effects, ["scale-factor", "bias", "delay"]);
//! // "Your gyro is 12.0 ± 0.2 ms late. That makes … of error over 1 s; corrected, … is left, which is noise."
//! println!("{}", headline::of(&axes[0], Voice::Library).answer);
//! # assert!(headline::of(&axes[0], Voice::Library).answer.contains("ms late"));
//! # assert!(model.axes[0].is_some());
//! # Ok::<(), gyro_model::fit::FitError>(())
//! ```
//!
//! # Compensate a vehicle's readings
//!
//! The estimator takes one row after the other, allocates nothing and waits for nothing; a log goes through the same code.
//!
//! ```
//! use gyro_model::{Axis, AxisModel, Model, Row, estimator::{Estimator, Options}};
//!
//! let mut model = Model::default();
//! let mut own = AxisModel::base(Axis::Z);
//! own.terms[0].values[0] = 1.02; // α: the gyro reads 2 % too little
//! model.axes[Axis::Z.index()] = Some(own);
//!
//! let mut estimator = Estimator::new(Options::default());
//! estimator.set_model(&model);
//! for k in 0..100 {
//!     let row = Row { t_ns: k * 10_000_000, gyro: [f64::NAN, f64::NAN, 0.5], ..Row::EMPTY };
//!     let z = estimator.step(&row).axes[Axis::Z.index()];
//!     assert!((z.rate - 0.51).abs() < 1e-12);
//! }
//! ```
//!
//! # Modules
//!
//! | module | noun |
//! | --- | --- |
//! | [`record`] | a log in memory: columns over time |
//! | [`model`] | effects and their parameters, axis by axis |
//! | [`effects`] | the catalogue, one physical effect a file |
//! | [`simulate`] | logs whose truth is known |
//! | [`thin`] | fewer rows that say the same of slow things |
//! | [`compensation`] | from readings to rates, sample by sample |
//! | [`kalman`] | the filter of one axis |
//! | [`estimator`] | compensation and filters together: one row in, one estimate out |
//! | [`fault`] | a fault of the data: its kind and place |
//! | [`faults`] | faults of the data found, as against physics |
//! | [`paper`] | the paper's experiment, simulated |
//! | [`diagnosis`] | the result types, as the JSON interface has them |
//! | [`detail`] | the pictures behind a verdict: overlay, regimes, spectrum, whiteness |
//! | [`align`] | how far two clocks lie apart, by the motion that both saw |
//! | [`nls`] | Levenberg–Marquardt on normal equations |
//! | [`evidence`] | what a log says about a model: residual, error curve, floor, noise, likelihood |
//! | [`finding`] | what is found of an axis, as data: cases with their numbers |
//! | [`fit`] | the model's parameters on a log |
//! | [`thresholds`] | every number that a decision is held against |
//! | [`diagnose`] | which effect is missing: scan, refit, tests of admission, search, verdict |
//! | [`pooled`] | many logs: their normal equations, what repeats, means and spreads of a type of sensor |
//! | [`learning`] | beside a stream: parameters refitted, whether they are worth taking, another model on trial |
//! | [`guide`] | which manoeuvre of the sensor would tell most of what is still to be known |
//! | [`headline`], [`drift`] | the answer in a sentence, of one axis or of several; how far off an angle is without a reference |
//! | [`words`] | findings in sentences, with a voice for logs, streams and libraries |
//! | [`axis`] | the axes x, y, z |
//! | [`units`] | SI numbers in the units that engineers say |
//! | [`measured`] | a value with its standard error, as effects say it |

#![warn(unreachable_pub)]

pub mod align;
pub mod axis;
mod budget;
pub mod compensation;
pub mod detail;
pub mod diagnose;
pub mod diagnosis;
pub mod drift;
pub mod effects;
pub mod estimator;
pub mod evidence;
pub mod fault;
pub mod faults;
pub mod finding;
pub mod fit;
pub mod guide;
mod history;
pub mod kalman;
pub mod learning;
mod limits;
pub mod measured;
pub mod model;
pub mod nls;
mod observer;
mod order;
pub mod paper;
pub mod parallel;
pub mod pooled;
mod process_noise;
pub mod record;
mod scan;
pub mod simulate;
mod statistics;
mod streams;
pub mod thin;
pub mod thresholds;
pub mod units;
pub mod words;

pub use axis::Axis;
pub use model::{AxisModel, Model, Noise, Term};
pub use record::{Record, Row};
pub use words::headline;
