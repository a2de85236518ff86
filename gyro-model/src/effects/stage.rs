//! Where an effect acts, and the functions that it has there: one trait a stage.

use super::{Effect, Memory, Signals, Window};

/// Where an effect acts between the true motion and the two readings.
///
/// Forward order: true rate → `Timing` → `Response` of the mount → `Felt` → `Response` of the sensor →
/// `Calibration` → `Reading` → noise and quantisation; and for the reference, true angle → `Shown` → `Reference` → noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// `scale-factor` and `bias`: ω̂ = α ω_g + δ − …
    Calibration,
    /// Adds [`Felt::error`] to the felt rate, rad/s.
    Felt,
    /// A reading taken at `t` belongs to [`Timing::valid_time`].
    Timing,
    /// A linear filter between true and felt rate, undone by [`Response::undo_response`].
    Response,
    /// Limits the reading itself; where [`Reading::lost`] says so the information is gone.
    Reading,
    /// Adds [`ReferenceAngle::error`] to the reference angle, rad.
    Reference,
    /// The reference shows a mean of the motion about each instant, [`Shown::window`].
    Shown,
}

impl Stage {
    /// Whether what acts here is the reference's, and the gyro is not to blame.
    #[must_use]
    pub fn is_of_reference(self) -> bool {
        matches!(self, Self::Reference | Self::Shown)
    }

    /// Whether what acts here is of the whole sensor or reference, the same on all its axes.
    #[must_use]
    pub fn is_of_whole_sensor(self) -> bool {
        matches!(self, Self::Timing | Self::Response | Self::Shown)
    }
}

/// The same with what an effect does there.
#[derive(Clone, Copy)]
pub enum Acts<'a> {
    /// α or δ of the calibration.
    Calibration,
    /// See [`Stage::Felt`].
    Felt(&'a dyn Felt),
    /// See [`Stage::Timing`].
    Timing(&'a dyn Timing),
    /// See [`Stage::Response`].
    Response(&'a dyn Response),
    /// See [`Stage::Reading`].
    Reading(&'a dyn Reading),
    /// See [`Stage::Reference`].
    Reference(&'a dyn ReferenceAngle),
    /// See [`Stage::Shown`].
    Shown(&'a dyn Shown),
}

impl Acts<'_> {
    /// The stage alone.
    #[must_use]
    pub fn stage(self) -> Stage {
        match self {
            Self::Calibration => Stage::Calibration,
            Self::Felt(_) => Stage::Felt,
            Self::Timing(_) => Stage::Timing,
            Self::Response(_) => Stage::Response,
            Self::Reading(_) => Stage::Reading,
            Self::Reference(_) => Stage::Reference,
            Self::Shown(_) => Stage::Shown,
        }
    }
}

/// An error of the felt rate.
pub trait Felt {
    /// Σβφ, rad/s. Called once a sample in time order; zero when `p` is neutral.
    fn error(&self, p: &[f64], signals: &Signals, memory: &mut Memory) -> f64;

    /// The same as compensation subtracts it, evaluated at the compensated rate. Another function only where the reading does not
    /// determine the rate, and ω̂ = ω_f − error(ω̂) has many solutions.
    fn error_seen(&self, p: &[f64], signals: &Signals, memory: &mut Memory) -> f64 {
        self.error(p, signals, memory)
    }

    /// Whether the reading is held while the rate moves, so that only looking ahead tells the rate ([`Felt::error_whole`]).
    fn is_play(&self) -> bool {
        false
    }

    /// Of a play: the same over a whole log: `felt` rates at times `t` (s), other errors already subtracted.
    fn error_whole(&self, _p: &[f64], _t: &[f64], _felt: &[f64]) -> ErrorWhole {
        ErrorWhole::default()
    }
}

/// A shift between the clocks of gyro and reference.
pub trait Timing {
    /// The time, on the reference's clock, whose true rate is read at `t`, s.
    fn valid_time(&self, p: &[f64], t: f64) -> f64;

    /// The part of [`Self::valid_time`] that only the reference can cause, s. The gyro's own time is earlier by it.
    fn reference_late(&self, _p: &[f64]) -> f64 {
        0.0
    }
}

/// A linear filter between true and felt rate.
pub trait Response {
    /// Forward: one step of the filter, `dt` after the previous one; true rate in, felt rate out.
    fn respond(&self, p: &[f64], rate: f64, dt: f64, memory: &mut Memory) -> f64;

    /// Backward and causal: one step; felt rate in, true rate out.
    fn undo_response(&self, p: &[f64], felt: f64, dt: f64, memory: &mut Memory) -> f64;

    /// Backward over a whole log with centred derivatives: felt rates at times `t` (s), true rates out.
    fn undo_response_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> Vec<f64>;

    /// Backward: how far a reading reaches into the rates beside it, beyond two samples, s.
    fn reach(&self, _p: &[f64]) -> f64 {
        0.0
    }
}

/// A limit of the reading.
pub trait Reading {
    /// Forward: what the sensor puts out where it would have read `reading`, rad/s.
    fn limit(&self, p: &[f64], reading: f64) -> f64;

    /// Backward: whether this reading says nothing about the rate.
    fn lost(&self, p: &[f64], reading: f64) -> bool;
}

/// An error of the reference's angle.
pub trait ReferenceAngle {
    /// Σκψ, rad. Called once a sample in time order; zero when `p` is neutral.
    fn error(&self, p: &[f64], signals: &Signals, memory: &mut Memory) -> f64;

    /// Whether a reference that errs by this, rad, says nothing of the angle.
    fn silent(&self, _p: &[f64], _error: f64) -> bool {
        false
    }

    /// Whether the error that left this in memory is a guess yet: where it starts from nobody knows.
    fn is_guess(&self, _p: &[f64], _memory: &Memory) -> bool {
        false
    }
}

/// A reference that shows a mean of the motion.
pub trait Shown {
    /// What is shown less what is, from what is known at that instant, rad. Called once a sample in time order.
    fn error(&self, p: &[f64], signals: &Signals, memory: &mut Memory) -> f64;

    /// The mean of the motion that the reference shows; `dt`, s, apart are the samples.
    fn window(&self, p: &[f64], dt: f64) -> Window;

    /// How far what is shown reaches into the motion before and after, s.
    fn reach(&self, p: &[f64]) -> f64;
}

/// The error of every sample of a log.
#[derive(Clone, Debug, Default)]
pub struct ErrorWhole {
    /// rad/s.
    pub error: Vec<f64>,
    /// Where the reading does not determine it, and `error` is a guess.
    pub unsure: Vec<bool>,
    /// Where the rate was held within a backlash: it may rest at the end that it last reached, which `error` assumes, or anywhere back
    /// from there.
    pub held: Vec<bool>,
}

/// What an effect does at its stage, and nothing at any other.
impl dyn Effect + '_ {
    /// [`Felt::error`], rad/s, [`ReferenceAngle::error`] or [`Shown::error`], rad.
    #[must_use]
    pub fn error(&self, p: &[f64], signals: &Signals, memory: &mut Memory) -> f64 {
        match self.acts() {
            Acts::Felt(felt) => felt.error(p, signals, memory),
            Acts::Reference(reference) => reference.error(p, signals, memory),
            Acts::Shown(shown) => shown.error(p, signals, memory),
            _ => 0.0,
        }
    }

    /// [`Felt::error_seen`], or the error of a reference.
    #[must_use]
    pub fn error_seen(&self, p: &[f64], signals: &Signals, memory: &mut Memory) -> f64 {
        match self.acts() {
            Acts::Felt(felt) => felt.error_seen(p, signals, memory),
            _ => self.error(p, signals, memory),
        }
    }

    /// [`Felt::is_play`]
    #[must_use]
    pub fn is_play(&self) -> bool {
        matches!(self.acts(), Acts::Felt(felt) if felt.is_play())
    }

    /// [`Felt::error_whole`]
    #[must_use]
    pub fn error_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> ErrorWhole {
        match self.acts() {
            Acts::Felt(effect) => effect.error_whole(p, t, felt),
            _ => ErrorWhole::default(),
        }
    }

    /// [`Timing::valid_time`]
    #[must_use]
    pub fn valid_time(&self, p: &[f64], t: f64) -> f64 {
        match self.acts() {
            Acts::Timing(timing) => timing.valid_time(p, t),
            _ => t,
        }
    }

    /// [`Timing::reference_late`]
    #[must_use]
    pub fn reference_late(&self, p: &[f64]) -> f64 {
        match self.acts() {
            Acts::Timing(timing) => timing.reference_late(p),
            _ => 0.0,
        }
    }

    /// [`Response::respond`]
    #[must_use]
    pub fn respond(&self, p: &[f64], rate: f64, dt: f64, memory: &mut Memory) -> f64 {
        match self.acts() {
            Acts::Response(response) => response.respond(p, rate, dt, memory),
            _ => rate,
        }
    }

    /// [`Response::undo_response`]
    #[must_use]
    pub fn undo_response(&self, p: &[f64], felt: f64, dt: f64, memory: &mut Memory) -> f64 {
        match self.acts() {
            Acts::Response(response) => response.undo_response(p, felt, dt, memory),
            _ => felt,
        }
    }

    /// [`Response::undo_response_whole`]
    #[must_use]
    pub fn undo_response_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> Vec<f64> {
        match self.acts() {
            Acts::Response(response) => response.undo_response_whole(p, t, felt),
            _ => felt.to_vec(),
        }
    }

    /// [`Shown::window`]
    #[must_use]
    pub fn window(&self, p: &[f64], dt: f64) -> Window {
        match self.acts() {
            Acts::Shown(shown) => shown.window(p, dt),
            _ => Window::of_nothing(),
        }
    }

    /// [`Response::reach`] or [`Shown::reach`], s.
    #[must_use]
    pub fn reach(&self, p: &[f64]) -> f64 {
        match self.acts() {
            Acts::Response(response) => response.reach(p),
            Acts::Shown(shown) => shown.reach(p),
            _ => 0.0,
        }
    }

    /// [`Reading::limit`]
    #[must_use]
    pub fn limit(&self, p: &[f64], reading: f64) -> f64 {
        match self.acts() {
            Acts::Reading(limit) => limit.limit(p, reading),
            _ => reading,
        }
    }

    /// [`Reading::lost`]
    #[must_use]
    pub fn lost(&self, p: &[f64], reading: f64) -> bool {
        matches!(self.acts(), Acts::Reading(limit) if limit.lost(p, reading))
    }

    /// [`ReferenceAngle::silent`]
    #[must_use]
    pub fn silent(&self, p: &[f64], error: f64) -> bool {
        matches!(self.acts(), Acts::Reference(reference) if reference.silent(p, error))
    }

    /// [`ReferenceAngle::is_guess`]
    #[must_use]
    pub fn is_guess(&self, p: &[f64], memory: &Memory) -> bool {
        matches!(self.acts(), Acts::Reference(reference) if reference.is_guess(p, memory))
    }
}
