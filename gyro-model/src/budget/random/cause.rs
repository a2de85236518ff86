//! The random causes: what is known of each beforehand, and what it makes of the variance of a window.

use super::course::{Course, Window};
use crate::diagnosis::LimitedBy;

/// What makes errors of random size and sign, of which only the variance follows the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// A scale that wanders within seconds.
    RandomScale,
    /// Noise that grows with the rate.
    RateNoise,
    /// A step at each reversal.
    ReversalSteps,
    /// A step at each start and stop.
    StartStopSteps,
    /// Motion in holes of the log.
    LostMotion,
}

/// Correlation times of a wandering scale, s.
pub(super) const FORGETS: [f64; 3] = [0.5, 2.0, SLOWLY];
/// The longest of them: what wanders over minutes, or drifts all through the log, is taken for this one.
pub(crate) const SLOWLY: f64 = 8.0;
/// Events that have to be in a log before their steps compete, and before they are named: the size is then known to a third.
const SOME: u64 = 2;
const EVENTS: u64 = 5;

impl Cause {
    pub(crate) const ALL: [Self; 5] =
        [Self::RandomScale, Self::RateNoise, Self::ReversalSteps, Self::StartStopSteps, Self::LostMotion];

    /// As it limits a log.
    pub(crate) const fn limit(self) -> LimitedBy {
        match self {
            Self::RandomScale => LimitedBy::RandomScale,
            Self::RateNoise => LimitedBy::RateNoise,
            Self::ReversalSteps => LimitedBy::ReversalSteps,
            Self::StartStopSteps => LimitedBy::StartStopSteps,
            Self::LostMotion => LimitedBy::LostMotion,
        }
    }

    /// Unit of its size.
    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::RandomScale => "1",
            Self::RateNoise => "rad/√rad",
            Self::ReversalSteps | Self::StartStopSteps | Self::LostMotion => "rad",
        }
    }

    /// How often it happens in the log, where it is made of events.
    pub(crate) fn events(self, course: &Course) -> Option<u64> {
        let last = |counted: &[f64]| counted.last().copied().unwrap_or(0.0).round() as u64;
        match self {
            Self::RandomScale | Self::RateNoise => None,
            Self::ReversalSteps => Some(last(&course.reversals)),
            Self::StartStopSteps => Some(last(&course.starts)),
            Self::LostMotion => Some(last(&course.holes)),
        }
    }

    /// Whether it may have acted at all: it competes.
    pub(crate) fn may_act(self, course: &Course) -> bool {
        self.events(course).is_none_or(|events| events >= SOME)
    }

    /// Whether the log holds enough of what it needs to be named.
    pub(crate) fn may_show(self, course: &Course) -> bool {
        self.events(course).is_none_or(|events| events >= EVENTS)
    }

    /// Its forms: of each, the variance of the angle error in a window, rad², for a coefficient of 1.
    ///
    /// ```text
    /// random-scale      ∬ ω(a) ω(b) e^(−|a − b|/T) da db for three T: the coefficients add up to the variance of the scale
    /// rate-noise        ∫|ω| dt, ∫ω² dt
    /// reversal-steps    number of reversals (each step stays); 1 where there is one (the next undoes it)
    /// start-stop-steps  the same of starts and stops
    /// lost-motion       Σ over holes of (length · |ω|)², Σ over holes of (length · change of ω)²
    /// ```
    pub(crate) fn forms(self, course: &Course, window: Window) -> Vec<f64> {
        let over = |counted: &[f64]| counted[window.to] - counted[window.from];
        match self {
            Self::RandomScale => FORGETS.map(|time| course.scale_walk(window, time)).to_vec(),
            Self::RateNoise => vec![over(&course.travelled), over(&course.squared)],
            Self::ReversalSteps => vec![over(&course.reversals), over(&course.reversals).min(1.0)],
            Self::StartStopSteps => vec![over(&course.starts), over(&course.starts).min(1.0)],
            Self::LostMotion => vec![over(&course.lost), over(&course.lost_changes)],
        }
    }

    /// How many forms it has.
    pub(crate) const fn count(self) -> usize {
        match self {
            Self::RandomScale => FORGETS.len(),
            _ => 2,
        }
    }

    /// The square of its size, as a weight of each coefficient; `means` are the mean forms over the log's windows.
    pub(crate) fn size_weights(self, means: &[f64], course: &Course) -> Vec<f64> {
        let of_first = |k: usize| if means[0] > 0.0 { means[k] / means[0] } else { 0.0 };
        match self {
            // Each event makes one step: a coefficient is its mean square.
            Self::RandomScale | Self::ReversalSteps | Self::StartStopSteps => vec![1.0; means.len()],
            Self::RateNoise => (0..means.len()).map(of_first).collect(),
            Self::LostMotion => {
                let holes = course.holes.last().copied().unwrap_or(0.0).max(1.0);
                [&course.lost, &course.lost_changes].map(|sum| sum.last().copied().unwrap_or(0.0) / holes).to_vec()
            }
        }
    }
}
