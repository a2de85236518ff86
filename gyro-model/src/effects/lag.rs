//! `lag`: first-order sensor bandwidth, τ dω_f/dt + ω_f = ω.

use super::{
    Acts, Alias, Card, Effect, Lately, Memory, ParameterCard, Response, Role, STEADY, Span, derivative, low_pass,
    steadied,
};
use crate::Axis;
use crate::measured::Measured;
use crate::units;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// The effect.
pub static LAG: Lag = Lag;

/// See the file's head.
pub struct Lag;

static CARD: Card = Card {
    id: "lag",
    title: "first-order bandwidth: the gyro smooths the rate",
    physics: "The sensor's own low-pass filter follows the rate with a time constant: quick changes come late and \
              smaller.",
    equation: "τ dω_f/dt + ω_f = ω",
    typical: "τ 0.5–30 ms (bandwidth 5–300 Hz)",
    source: "IEEE Std 1431, bandwidth; the filter tables of MEMS data sheets",
    needs: &[],
    excited_by: "motion at frequencies near 1/(2πτ), steps",
    mended_by: "the inverse filter, which amplifies noise above 1/(2πτ)",
    at_source: "raise the cut-off of the sensor's low-pass filter",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "delay",
            when: "the motion has little content near the corner frequency 1/(2πτ)",
            split_by: "sharp steps, or motion up to the corner frequency: only a lag loses amplitude",
        },
        Alias {
            id: "g-sensitivity",
            when: "one sine of small amplitude, where gravity and dω/dt are proportional",
            split_by: "motion of more than one frequency, or of large amplitude",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "tau",
    unit: "s",
    says: "time constant",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.01,
    bounds: (0.0, 0.3),
}];

/// What compensation does, in C.
const IN_C: &str = "\
const double f1 = memory[0], f2 = memory[1], dt1 = memory[2];
double slope = 0.0;
if (memory[6] == 1.0) {
    slope = (felt - f1) / dt;
} else if (memory[6] > 1.0) {
    const double d1 = (felt - f1) / dt, d2 = (f1 - f2) / dt1;
    slope = d1 + (d1 - d2) * dt / (dt + dt1);
}
memory[0] = felt;
memory[1] = f1;
memory[2] = dt;
memory[6] = fmin(memory[6] + 1.0, 2.0);
return felt + tau * slope;";

impl Effect for Lag {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Response(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        let corner = 1.0 / (std::f64::consts::TAU * p[0].value);
        format!(
            "your gyro follows the rate slowly, with a time constant of {} (a bandwidth of {} Hz)",
            p[0].signed("s"),
            units::number(corner)
        )
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some(IN_C.into())
    }

    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        [3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06]
            .map(|tau| vec![tau])
            .to_vec()
    }
}

impl Response for Lag {
    /// Exact for a rate that is linear over the step.
    fn respond(&self, p: &[f64], rate: f64, dt: f64, memory: &mut Memory) -> f64 {
        let last = memory.of::<Last>();
        let felt = if last.started == 0.0 { rate } else { low_pass(last.felt, last.rate, rate, dt, p[0]) };
        *last = Last { felt, rate, started: 1.0 };
        felt
    }

    /// ω = ω_f + τ dω_f/dt with the parabola through the last three samples.
    fn undo_response(&self, p: &[f64], felt: f64, dt: f64, memory: &mut Memory) -> f64 {
        let lately = memory.of::<Lately>();
        let ([f1, f2], dt1) = (lately.felt, lately.dt);
        let slope = match lately.samples {
            0.0 => 0.0,
            1.0 => (felt - f1) / dt,
            _ => {
                let (d1, d2) = ((felt - f1) / dt, (f1 - f2) / dt1);
                d1 + (d1 - d2) * dt / (dt + dt1)
            }
        };
        lately.take(felt, dt);
        felt + p[0] * slope
    }

    fn undo_response_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> Vec<f64> {
        // The slope of the reading's noise is no motion: undone, it would look like physics of its own.
        let slope = derivative(t, &steadied(t, felt));
        felt.iter().zip(slope).map(|(f, d)| f + p[0] * d).collect()
    }

    fn reach(&self, _: &[f64]) -> f64 {
        STEADY
    }
}
/// What the filter remembers.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Last {
    felt: f64,
    rate: f64,
    /// 1 after the first sample.
    started: f64,
}
