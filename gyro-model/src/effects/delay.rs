//! `delay`: the gyro is later than the reference, ω_f(t) = ω(t − d).

use super::{Acts, Alias, Card, Effect, ParameterCard, Role, Span, Timing};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static DELAY: Delay = Delay;

/// See the file's head.
pub struct Delay;

static CARD: Card = Card {
    id: "delay",
    title: "the gyro is later than the reference (negative: earlier)",
    physics: "The sensor's digital filter, its bus and the time-stamping at the receiver all take time, so the \
              reading stamped t belongs to t − d. At rate ω the angle is wrong by about ω d.",
    equation: "ω_f(t) = ω(t − d)",
    typical: "1–100 ms; 12 ms seen on an MPU-6050",
    source: "IEEE Std 1431, time delay; measured against encoders",
    needs: &[],
    excited_by: "changing rates, more than one frequency",
    mended_by: "re-stamping: the estimate is valid at t − d, live and in logs; where d is negative the reference is late, and the \
                estimate keeps the gyro's own time",
    at_source: "stamp gyro and reference when they measure (at the sensor's interrupt), not when they are received; raise the cut-off of the low-pass filter of whichever is late",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "lag",
            when: "the motion has little content near the corner frequency 1/(2πτ)",
            split_by: "sharp steps, or motion up to the corner frequency: only a lag loses amplitude",
        },
        Alias {
            id: "g-sensitivity",
            when: "the sensor sits on an arm, so that tangential acceleration follows dω/dt; always, to first order",
            split_by: "another radius, or shaking without turning; or the accelerometer as regressor",
        },
        Alias {
            id: "reference-lag",
            when: "the gyro is early, and the motion has little content near the corner frequency of the reference",
            split_by: "sharp steps, or motion up to the corner frequency: only a lag loses amplitude",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "d",
    unit: "s",
    says: "how late the gyro is",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.01,
    bounds: (-0.5, 0.5),
}];

impl Effect for Delay {
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
        if p[0].value < 0.0 {
            // No gyro reads a rate before it is there: what is later is the reference, or a clock is off.
            return format!(
                "the gyro and its reference are {} apart, the gyro first: the reference is late, or its clock is",
                p[0].size("s")
            );
        }
        format!("your gyro is {} late", p[0].size("s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return d > 0.0 ? t - d : t; /* d < 0: the reference is late */".into())
    }

    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        // Some microseconds show on a minute of brisk motion. Small ones are parts of one another: a factor of three apart is
        // enough.
        let small = [3e-6, 1e-5, 3e-5, 1e-4, 3e-4].iter().flat_map(|&d| [d, -d]);
        let early = [-0.35, -0.2, -0.1, -0.06, -0.035, -0.02, -0.01, -0.005, -0.002, -0.001];
        let late = [0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1, 0.2];
        small.chain(early).chain(late).map(|d| vec![d]).collect()
    }
}

impl Timing for Delay {
    fn valid_time(&self, p: &[f64], t: f64) -> f64 {
        t - p[0]
    }

    fn reference_late(&self, p: &[f64]) -> f64 {
        (-p[0]).max(0.0)
    }
}
