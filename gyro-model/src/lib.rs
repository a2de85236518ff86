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
//! | module | noun |
//! | --- | --- |
//! | [`record`] | a log in memory: columns over time |
//! | [`model`] | effects and their parameters, axis by axis |
//! | [`effects`] | the catalogue, one physical effect a file |
//! | [`simulate`] | logs whose truth is known |
//! | [`thin`] | fewer rows that say the same of slow things |
//! | [`compensation`] | from readings to rates, sample by sample |
//! | [`history`] | the recent past of a signal |
//! | [`kalman`] | the filter of one axis |
//! | [`process_noise`] | how restless the motion is |
//! | [`observer`] | the paper's own filter |
//! | [`estimator`] | compensation and filters together: one row in, one estimate out |
//! | [`faults`] | faults of the data, as against physics |
//! | [`paper`] | the paper's experiment, simulated |
//! | [`diagnosis`] | the result types, as the JSON interface has them |
//! | [`detail`] | the pictures behind a verdict: overlay, regimes, spectrum, whiteness |
//! | [`align`] | how far two clocks lie apart, by the motion that both saw |
//! | [`statistics`] | values with their standard errors, from the blocks of a log |
//! | [`nls`] | Levenberg–Marquardt on normal equations |
//! | [`evidence`] | what a log says about a model: residual, error curve, floor, noise, likelihood |
//! | [`fit`] | the model's parameters on a log |
//! | [`limits`] | saturation and dead zone, as the readings show them |
//! | [`scan`] | the score test of every effect of the catalogue |
//! | [`thresholds`] | every number that a decision is held against |
//! | [`diagnose`] | which effect is missing: scan, refit, tests of admission, search, verdict |
//! | [`guide`] | which manoeuvre of the sensor would tell most of what is still to be known |
//! | [`budget`] | what the error that is left is made of: gyro, reference, clock, what is missing |

pub mod align;
pub mod axis;
pub mod budget;
pub mod compensation;
pub mod detail;
pub mod diagnose;
pub mod diagnosis;
pub mod effects;
pub mod estimator;
pub mod evidence;
pub mod faults;
pub mod fit;
pub mod guide;
pub mod headline;
pub mod history;
pub mod kalman;
pub mod limits;
pub mod measured;
pub mod model;
pub mod nls;
pub mod observer;
mod order;
pub mod paper;
mod parallel;
pub mod process_noise;
pub mod record;
pub mod scan;
pub mod simulate;
pub mod statistics;
pub mod thin;
pub mod thresholds;
pub mod units;

pub use axis::Axis;
pub use model::{AxisModel, Model, Noise, Term};
pub use record::{Record, Row};
