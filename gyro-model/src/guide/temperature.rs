//! A course of temperatures: still after switching on, cold, hot, and back again.
//!
//! A warm-up goes by the time since switching on and does not return; an effect of the temperature returns with the temperature. Only a
//! recording that has each temperature twice, at different times, tells the two apart.

use super::Kind;
use serde::Serialize;

/// What is done now.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Left alone after switching on.
    Settle,
    /// Made colder.
    Cool,
    /// Made warmer.
    Warm,
    /// Left to come back to where it began.
    Back,
    /// All of it was done.
    Over,
}

/// How the course stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Course {
    /// What is done now.
    pub phase: Phase,
    /// The temperature, °C; `None` before there is one.
    pub now: Option<f64>,
    /// That at which it began to be changed, °C.
    pub start: Option<f64>,
    /// Lowest and highest since, °C.
    pub low: Option<f64>,
    /// See `low`.
    pub high: Option<f64>,
    #[serde(skip)]
    began: Option<f64>,
    #[serde(skip)]
    last: f64,
}

/// Left alone for so long, s: most of a warm-up on a cheap part.
const SETTLES: f64 = 60.0;
/// Colder and hotter than at the start by so much, K. A zero that is known to 0.005 °/s at both ends then gives 0.00035 °/s per K: 2 % of
/// what is typical.
pub const SPAN: f64 = 10.0;
/// Back at the start to so much, K.
const NEAR: f64 = 2.0;
/// A temperature is averaged over so long, s.
const SMOOTH: f64 = 1.0;

impl Default for Course {
    fn default() -> Self {
        Self { phase: Phase::Settle, now: None, start: None, low: None, high: None, began: None, last: 0.0 }
    }
}

impl Course {
    /// Takes the next row's time, s, and temperature, °C.
    pub fn take(&mut self, t: f64, temperature: f64) {
        let began = *self.began.get_or_insert(t);
        if !temperature.is_finite() {
            return;
        }
        let share = self.now.map_or(1.0, |_| ((t - self.last) / SMOOTH).clamp(0.0, 1.0));
        self.last = t;
        let now = self.now.map_or(temperature, |now| now + share * (temperature - now));
        self.now = Some(now);
        if self.phase == Phase::Settle && t - began >= SETTLES {
            self.next();
        }
        let Some(start) = self.start else { return };
        self.low = Some(self.low.map_or(now, |low| low.min(now)));
        self.high = Some(self.high.map_or(now, |high| high.max(now)));
        let is_done = match self.phase {
            Phase::Cool => now <= start - SPAN,
            Phase::Warm => now >= start + SPAN,
            Phase::Back => (now - start).abs() <= NEAR,
            Phase::Settle | Phase::Over => false,
        };
        if is_done {
            self.next();
        }
    }

    /// Goes on to what comes next.
    pub fn next(&mut self) {
        self.phase = match self.phase {
            Phase::Settle => {
                (self.start, self.low, self.high) = (self.now, self.now, self.now);
                Phase::Cool
            }
            Phase::Cool => Phase::Warm,
            Phase::Warm => Phase::Back,
            Phase::Back | Phase::Over => Phase::Over,
        };
    }

    /// Whether all of it was done, or given up.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.phase == Phase::Over
    }

    /// What the hand does meanwhile: nothing while it lies in a fridge, slow turns where the scale factor is wanted too.
    #[must_use]
    pub(super) fn meanwhile(&self) -> Kind {
        match self.phase {
            Phase::Settle | Phase::Cool | Phase::Over => Kind::Rest,
            Phase::Warm | Phase::Back => Kind::Slow,
        }
    }

    /// What to do now.
    #[must_use]
    pub fn says(&self) -> String {
        let to = |by: f64| self.start.map_or_else(String::new, |start| format!(", to {:.0} °C", start + by));
        match self.phase {
            Phase::Settle if self.now.is_none() => {
                "leave it alone; the source has not given a temperature yet, and without one nothing is learnt here"
                    .to_owned()
            }
            Phase::Settle => {
                format!("leave it alone for {SETTLES:.0} s after switching on: what settles now is its warm-up")
            }
            Phase::Cool => {
                format!("cool it by {SPAN:.0} K{}: into a fridge, the cables out at its door", to(-SPAN))
            }
            Phase::Warm => {
                format!("warm it by {:.0} K{}: a hair-dryer from 30 cm, no hotter than 60 °C", 2.0 * SPAN, to(SPAN))
            }
            Phase::Back => format!("let it come back{}: the same temperature again, at another time", to(0.0)),
            Phase::Over => String::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_cold_hot_and_back_and_says_to_which_temperature() {
        let mut course = Course::default();
        let mut phases = Vec::new();
        // 25 °C, down to 13, up to 37, and down again.
        for k in 0..6000 {
            let t = 0.1 * f64::from(k);
            let since = (t - 60.0).max(0.0);
            course.take(t, 25.0 - 12.0 * (std::f64::consts::TAU * since / 400.0).sin());
            if phases.last() != Some(&course.phase) {
                phases.push(course.phase);
                match course.phase {
                    Phase::Cool => assert!(
                        course.says().starts_with("cool it by 10 K, to 15 °C: into a fridge"),
                        "{}",
                        course.says()
                    ),
                    Phase::Warm => assert!(course.says().contains("to 35 °C") && course.meanwhile() == Kind::Slow),
                    _ => {}
                }
            }
        }
        assert_eq!(phases, [Phase::Settle, Phase::Cool, Phase::Warm, Phase::Back, Phase::Over]);
        assert!(course.low.is_some_and(|low| low < 15.0) && course.high.is_some_and(|high| high > 35.0));
    }

    #[test]
    fn a_phase_may_be_skipped_and_a_source_without_a_temperature_stays_where_it_is() {
        let mut course = Course::default();
        for k in 0..100 {
            course.take(f64::from(k), f64::NAN);
        }
        assert_eq!((course.phase, course.now), (Phase::Settle, None));
        assert!(course.says().contains("has not given a temperature"), "{}", course.says());
        for wanted in [Phase::Cool, Phase::Warm, Phase::Back, Phase::Over, Phase::Over] {
            course.next();
            assert_eq!(course.phase, wanted);
        }
        assert!(course.is_over());
    }
}
