//! `temperature-rate`: the bias follows heating, not heat, φ = dT/dt.

use super::{Acts, Card, Effect, Felt, Memory, Need, ParameterCard, Role, Signals, Trait};
use crate::Axis;
use crate::measured::Measured;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// The effect.
pub static TEMPERATURE_RATE: TemperatureRate = TemperatureRate;

/// See the file's head.
pub struct TemperatureRate;

static CARD: Card = Card {
    id: "temperature-rate",
    title: "the zero-rate output changes with the rate of heating",
    physics: "While the package heats or cools, temperature gradients bend its structure. The error is zero when the \
             temperature is constant.",
    equation: "ω_f = ω + c dT/dt, dT/dt of the measured temperature: on a log from cubics as wide as its readings ask \
               for, live from a causal fading-memory parabola (time constant 0.7 s)",
    typical: "rarely in data sheets; 0.5–5 °/s per K/s seen on plastic packages",
    source: "IEEE Std 1431, bias temperature gradient sensitivity; fading-memory polynomial filter after N. Morrison",
    needs: &[Need::Temperature],
    excited_by: "heating and cooling within the log",
    mended_by: "well, where temperature is measured at the sensor and not too noisily",
    at_source: "slow the change of temperature: a cover against wind, more copper or mass at the sensor",
    traits: &[Trait::Slow],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "c",
    unit: "rad/s per K/s",
    says: "bias per rate of heating",
    role: Role::Linear,
    neutral: 0.0,
    typical: 0.05,
    bounds: (-10.0, 10.0),
}];

/// What compensation does, in C.
const IN_C: &str = "\
const double dt = in->dt, n = memory[3], age = memory[4];
if (n == 0.0 || dt <= 0.0) {
    memory[0] = in->delta_temperature;
    memory[3] = 1.0;
    return 0.0;
}
double alpha, beta, gamma;
if (age < 1.0) { /* the line through all samples yet */
    const double two = (n + 1.0) * (n + 2.0);
    alpha = 2.0 * (2.0 * n + 1.0) / two;
    beta = 6.0 / two;
    gamma = 0.0;
} else { /* the parabola that forgets with 0.7 s */
    const double theta = exp(-dt / 0.7), three = (n + 1.0) * (n + 2.0) * (n + 3.0);
    alpha = fmax(1.0 - theta * theta * theta, 3.0 * (3.0 * n * n + 3.0 * n + 2.0) / three);
    beta = fmax(1.5 * ((1.0 - theta) * (1.0 - theta)) * (1.0 + theta), 18.0 * (2.0 * n + 1.0) / three);
    gamma = fmax((1.0 - theta) * (1.0 - theta) * (1.0 - theta), 60.0 / three);
}
const double predicted = memory[0] + memory[1] * dt + 0.5 * memory[2] * dt * dt;
const double surprise = in->delta_temperature - predicted;
memory[0] = predicted + alpha * surprise;
memory[1] = memory[1] + memory[2] * dt + beta * surprise / dt;
memory[2] = memory[2] + gamma * surprise / (dt * dt);
memory[3] = n + 1.0;
memory[4] = age + dt;
const double trust = memory[4] * memory[4] / (memory[4] * memory[4] + 0.05 * 0.05);
return c * (trust * memory[1]);";

impl Effect for TemperatureRate {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Felt(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("your gyro's zero moves while its temperature changes, by {}", p[0].signed("rad/s per K/s"))
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some(IN_C.into())
    }
}

impl Felt for TemperatureRate {
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        if s.temperature_dot.is_finite() {
            return p[0] * s.temperature_dot;
        }
        p[0] * heating(s.delta_temperature, s.dt, memory.of())
    }
}

/// Time constant of the fading memory, s. The integral of the slope is the smoothed temperature, whose noise does not
/// grow; a longer memory would follow a cycle of a minute too late for an encoder not to notice.
const FADING: f64 = 0.7;
/// A line is fitted up to this age, a parabola from then on, s.
const LINE: f64 = 1.0;
/// Before this age the slope's noise exceeds any heating, s: the estimate is faded in.
const YOUNG: f64 = 0.05;

/// The parabola through the past temperatures.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Past {
    /// Temperature now, K, and its derivatives in seconds.
    level: f64,
    slope: f64,
    curvature: f64,
    /// Samples so far.
    samples: f64,
    /// Since the first, s.
    age: f64,
}

/// dT/dt now, K/s: slope of the parabola that fits the past with weights exp(−age/0.7 s), without lag for a parabola;
/// of all the past while that is younger.
fn heating(temperature: f64, dt: f64, past: &mut Past) -> f64 {
    let Past { level, slope, curvature, samples: n, age } = *past;
    if n == 0.0 || dt <= 0.0 {
        (past.level, past.samples) = (temperature, 1.0);
        return 0.0;
    }
    let [alpha, beta, gamma] = if age < LINE { expanding_line(n) } else { parabola(n, dt) };
    let predicted = level + slope * dt + 0.5 * curvature * dt * dt;
    let surprise = temperature - predicted;
    *past = Past {
        level: predicted + alpha * surprise,
        slope: slope + curvature * dt + beta * surprise / dt,
        curvature: curvature + gamma * surprise / (dt * dt),
        samples: n + 1.0,
        age: age + dt,
    };
    let trust = past.age * past.age / (past.age * past.age + YOUNG * YOUNG);
    trust * past.slope
}

/// Gains of the least-squares line through all samples, this one the n-th after the first.
fn expanding_line(n: f64) -> [f64; 3] {
    let two = (n + 1.0) * (n + 2.0);
    [2.0 * (2.0 * n + 1.0) / two, 6.0 / two, 0.0]
}

/// Gains of the parabola with fading memory, or of that through all samples while it is younger.
fn parabola(n: f64, dt: f64) -> [f64; 3] {
    let theta = (-dt / FADING).exp();
    let three = (n + 1.0) * (n + 2.0) * (n + 3.0);
    [
        (1.0 - theta.powi(3)).max(3.0 * (3.0 * n * n + 3.0 * n + 2.0) / three),
        (1.5 * (1.0 - theta).powi(2) * (1.0 + theta)).max(18.0 * (2.0 * n + 1.0) / three),
        (1.0 - theta).powi(3).max(60.0 / three),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_of_temperature_gives_its_slope_without_lag() {
        let mut past = Past::default();
        let (dt, truth) = (0.01, |t: f64| 0.2 - 0.002 * t);
        for k in 0..5000 {
            let t = f64::from(k) * dt;
            let got = heating(0.2 * t - 0.001 * t * t, dt, &mut past);
            if t > 4.0 {
                assert!((got - truth(t)).abs() < 1e-4, "at {t} s: {got} for {}", truth(t));
            }
        }
    }

    #[test]
    fn the_integral_of_the_slope_is_the_temperature_though_it_is_noisy_and_quantised() {
        let truth = |t: f64| 9.0 * (1.0 - (-t / 70.0).exp()) + 1.3 * (t * 0.12).sin();
        let (mut past, mut integral, mut worst) = (Past::default(), 0.0, 0.0_f64);
        for k in 0..12_000_u32 {
            let t = f64::from(k) * 0.01;
            let noise = f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5;
            let measured = ((truth(t) + 0.07 * noise) * 100.0).round() / 100.0;
            integral += 0.01 * heating(measured, 0.01, &mut past);
            worst = worst.max((integral - truth(t)).abs());
        }
        assert!(worst < 0.08, "{worst} K off");
    }
}
