//! `clock-skew`: the two clocks run apart, ω_f(t) = ω(t(1 + s)).

use super::{Acts, Card, Effect, ParameterCard, Role, Span, Timing};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static CLOCK_SKEW: ClockSkew = ClockSkew;

/// See the file's head.
pub struct ClockSkew;

static CARD: Card = Card {
    id: "clock-skew",
    title: "the clocks of gyro and reference run at different rates",
    physics: "Sensor and reference are stamped by two oscillators. Stamps that agree at the start differ by s·t later, \
             so the error grows with the length of the log.",
    equation: "ω_f(t) = ω(t (1 + s)), t from the log's first row",
    typical: "10–100 ppm with quartz, up to 5000 ppm with an RC oscillator",
    source: "oscillator tolerances in MEMS data sheets",
    needs: &[],
    excited_by: "a long log with changing rates throughout",
    mended_by: "re-stamping",
    at_source: "stamp gyro and reference with the same clock",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "s",
    unit: "1",
    says: "by how much its clock is slow: a reading stamped t is of t (1 + s)",
    role: Role::Shape,
    neutral: 0.0,
    typical: 1e-3,
    bounds: (-0.05, 0.05),
}];

impl Effect for ClockSkew {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Timing(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("your gyro's clock is {} {}", p[0].size("1"), if p[0].value > 0.0 { "slow" } else { "fast" })
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return t * (1.0 + s);".into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        /// Displacement at the log's end that one step of the grid may make, s: a quarter of a period at some 5 Hz.
        const STEP: f64 = 0.05;
        const LARGEST: f64 = 5e-3;
        /// The longest log that the grid is made for, s.
        const LONGEST: f64 = 1e7;
        let duration = span.duration.min(LONGEST);
        let steps = (LARGEST * duration / STEP).ceil().clamp(4.0, 24.0);
        let mut sizes: Vec<f64> = (1..=steps as u32).map(|k| LARGEST * f64::from(k) / steps).collect();
        let mut fine = 0.4 * sizes[0];
        while fine * duration > 1e-5 {
            sizes.push(fine);
            fine *= 0.4;
        }
        sizes.iter().flat_map(|&s| [vec![-s], vec![s]]).collect()
    }
}

impl Timing for ClockSkew {
    fn valid_time(&self, p: &[f64], t: f64) -> f64 {
        t * (1.0 + p[0])
    }
}
