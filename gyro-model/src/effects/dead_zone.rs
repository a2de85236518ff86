//! `dead-zone`: small readings come out as zero.

use super::{Acts, Alias, Card, Effect, ParameterCard, Reading, Role, Span, Trait};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static DEAD_ZONE: DeadZone = DeadZone;

/// See the file's head.
pub struct DeadZone;

static CARD: Card = Card {
    id: "dead-zone",
    title: "slow rates are read as zero",
    physics: "A threshold in the sensor or its driver sets small readings to zero, so slow turns are never seen. The \
              zone lies around a reading of zero, not around zero rate.",
    equation: "ω_g = 0 where |ω_g| < w",
    typical: "0.05–3 °/s of reading, where drivers have one",
    source: "IEEE Std 1431, dead band; drivers of low-cost boards",
    needs: &[],
    excited_by: "slow turns",
    mended_by: "nothing: the sample is marked and the standard deviation grows; switch the threshold off",
    at_source: "switch the driver's dead zone or threshold off",
    traits: &[Trait::Hole],
    simpler: &[],
    aliases: &[
        Alias {
            id: "cubic-nonlinearity",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: a dead zone is always at the same rate, a curve is not",
        },
        Alias {
            id: "saturation",
            when: "the motion has one amplitude",
            split_by: "several amplitudes: saturation acts at the end of the range, a dead zone around zero",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "w",
    unit: "rad/s",
    says: "largest reading that comes out as zero",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.03,
    bounds: (0.0, 2.0),
}];

impl Effect for DeadZone {
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
        format!("your gyro, or its driver, puts out zero for every reading below {}", p[0].signed("rad/s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return fabs(reading) < w;".into())
    }

    /// The zone ends where the readings begin: between zero and the smallest other reading there is nothing.
    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        if span.reading_min < 2.0 { vec![vec![span.reading_min]] } else { Vec::new() }
    }
}

impl Reading for DeadZone {
    fn limit(&self, p: &[f64], reading: f64) -> f64 {
        if reading.abs() < p[0] { 0.0 } else { reading }
    }

    fn lost(&self, p: &[f64], reading: f64) -> bool {
        reading.abs() < p[0]
    }
}
