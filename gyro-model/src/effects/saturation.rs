//! `saturation`: the range ends, ω_g held within ±l.

use super::{Acts, Alias, Card, Effect, ParameterCard, Reading, Role, Span, Trait, within};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static SATURATION: Saturation = Saturation;

/// See the file's head.
pub struct Saturation;

static CARD: Card = Card {
    id: "saturation",
    title: "end of range: faster rates are cut off",
    physics: "Beyond its range the sensor puts out its largest reading, whatever the rate.",
    equation: "ω_g held within ±l",
    typical: "97 % of the full scale in the data sheet",
    source: "IEEE Std 1431, input rate limits; MEMS data sheets",
    needs: &[],
    excited_by: "turns faster than the range",
    mended_by: "nothing: the sample is marked and the standard deviation grows; choose a wider range",
    at_source: "set a wider range in the sensor, or turn more slowly",
    traits: &[Trait::Ceiling],
    simpler: &[],
    aliases: &[
        Alias {
            id: "cubic-nonlinearity",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: a limit is always at the same rate, a curve is not",
        },
        Alias {
            id: "dead-zone",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: saturation acts at the end of the range, a dead zone around zero",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "l",
    unit: "rad/s",
    says: "largest reading",
    role: Role::Shape,
    neutral: f64::INFINITY,
    typical: 2.1,
    bounds: (0.01, f64::INFINITY),
}];

/// A rail in whole steps of the converter may lie half a step below `l`.
const NEAR: f64 = 0.999;

impl Effect for Saturation {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Reading(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("your gyro's range ends at {}", p[0].signed("rad/s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return fabs(reading) >= 0.999 * l;".into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        [1.0, 0.995, 0.98, 0.95].iter().map(|share| vec![(share * span.reading_max).max(0.01)]).collect()
    }
}

impl Reading for Saturation {
    fn limit(&self, p: &[f64], reading: f64) -> f64 {
        within(reading, -p[0], p[0])
    }

    fn lost(&self, p: &[f64], reading: f64) -> bool {
        reading.abs() >= NEAR * p[0]
    }
}
