//! `temperature-rate`: the bias follows heating, not heat, φ = dT/dt.

use super::{Card, Effect, Memory, Need, ParameterCard, Role, Signals, Stage};
use crate::Axis;

/// The effect.
pub static TEMPERATURE_RATE: TemperatureRate = TemperatureRate;

/// See the file's head.
pub struct TemperatureRate;

static CARD: Card = Card {
    id: "temperature-rate",
    title: "bias against heating rate",
    physics: "While it heats or cools the package is not at one temperature: its gradients bend the structure, and \
              the error goes when the temperature stands still.",
    equation: "ω_f = ω + c dT/dt, dT/dt from a causal fading-memory parabola (time constant 4 s) through the \
               measured temperature",
    typical: "hardly ever printed; 0.5–5 °/s per K/s seen on plastic packages",
    source: "IEEE Std 1431, bias temperature gradient sensitivity; fading-memory polynomial filter after N. Morrison",
    needs: &[Need::Temperature],
    excited_by: "heating and cooling, quick against the log",
    mended_by: "well, where temperature is measured at the sensor and not too noisily",
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

impl Effect for TemperatureRate {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn stage(&self) -> Stage {
        Stage::Felt
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        p[0] * heating(s.delta_temperature, s.dt, memory)
    }
}

/// Time constant of the fading memory, s: long against the noise of a 0.01 °C sensor, short against heating.
const FADING: f64 = 4.0;
/// Before this age the slope's noise exceeds any heating, s: the estimate is faded in.
const YOUNG: f64 = 0.4;

/// dT/dt now, K/s: slope of the parabola that fits the past with weights exp(−age/4 s), without lag for a parabola; of
/// all the past while that is younger. Memory: [0] level, [1] slope, [2] curvature, [3] samples, [4] age.
fn heating(temperature: f64, dt: f64, memory: &mut Memory) -> f64 {
    let [level, slope, curvature, n, age, ..] = *memory;
    if n == 0.0 || dt <= 0.0 {
        [memory[0], memory[3]] = [temperature, 1.0];
        return 0.0;
    }
    let theta = (-dt / FADING).exp();
    let young = (n + 1.0) * (n + 2.0) * (n + 3.0);
    let alpha = (1.0 - theta.powi(3)).max(3.0 * (3.0 * n * n + 3.0 * n + 2.0) / young);
    let beta = (1.5 * (1.0 - theta).powi(2) * (1.0 + theta)).max(18.0 * (2.0 * n + 1.0) / young);
    let gamma = (1.0 - theta).powi(3).max(60.0 / young);
    let predicted = level + slope * dt + 0.5 * curvature * dt * dt;
    let surprise = temperature - predicted;
    memory[0] = predicted + alpha * surprise;
    memory[1] = slope + curvature * dt + beta * surprise / dt;
    memory[2] = curvature + gamma * surprise / (dt * dt);
    memory[3] = n + 1.0;
    memory[4] = age + dt;
    let trust = memory[4] * memory[4] / (memory[4] * memory[4] + YOUNG * YOUNG);
    trust * memory[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_of_temperature_gives_its_slope_without_lag() {
        let mut memory = Memory::default();
        let (dt, truth) = (0.01, |t: f64| 0.2 - 0.002 * t);
        for k in 0..5000 {
            let t = f64::from(k) * dt;
            let got = heating(0.2 * t - 0.001 * t * t, dt, &mut memory);
            if t > 5.0 {
                assert!((got - truth(t)).abs() < 2e-3, "at {t} s: {got} for {}", truth(t));
            }
        }
    }

    #[test]
    fn the_noise_of_a_quantised_temperature_stays_below_a_thousandth_of_a_kelvin_per_second() {
        let mut memory = Memory::default();
        let mut square = 0.0;
        for k in 0..20_000_u32 {
            let noise = f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5;
            let quantised = ((20.0 + 0.07 * noise) * 100.0).round() / 100.0;
            let got = heating(quantised, 0.01, &mut memory);
            if k >= 10_000 {
                square += got * got / 10_000.0;
            }
        }
        assert!(square.sqrt() < 1e-3, "{}", square.sqrt());
    }
}
