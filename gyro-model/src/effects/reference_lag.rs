//! `reference-lag`: the reference has a first-order low-pass filter of its own, τ dθ_e/dt + θ_e = θ.
//!
//! Software computes it once a reading, h apart: θ_e goes on by (θ − θ_e) h/(τ + h). Slow motion is shown late by τ, whatever h is.

use super::{Acts, Alias, Card, Effect, Memory, ParameterCard, Role, Shown, Signals, Span, Window};
use crate::Axis;
use crate::measured::Measured;
use crate::units;
use bytemuck::{Pod, Zeroable};

/// The effect.
pub static REFERENCE_LAG: ReferenceLag = ReferenceLag;

/// See the file's head.
pub struct ReferenceLag;

static CARD: Card = Card {
    id: "reference-lag",
    title: "the reference has a low-pass filter of its own and follows slowly",
    physics: "A pose estimator, a driver with a smoothing constant or an RC filter follows the motion with a time constant. \
              The reference then shows quick changes late and smaller, and the gyro seems to be early.",
    equation: "τ dθ_e/dt + θ_e = θ",
    typical: "τ 5–100 ms (filtered poses, drivers with a smoothing constant)",
    source: "First-order low-pass filter: transfer function 1/(1 + 2πifτ), in steps of the implicit Euler method",
    needs: &[],
    excited_by: "motion at frequencies near 1/(2πτ), steps",
    mended_by: "the model is compared with the reference as it lags; live, what it lags by is taken out of the reference",
    at_source: "switch off the low-pass filter of the reference, or raise its cut-off, in the driver's or the estimator's settings",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "delay",
            when: "the motion has little content near the corner frequency 1/(2πτ): the gyro is early by τ",
            split_by: "sharp steps, or motion up to the corner frequency: only a lag loses amplitude",
        },
        Alias {
            id: "mount-resonance",
            when: "beside a delay, where the motion stays far below the resonance: both make the gyro's rate larger with the square of \
                   the frequency",
            split_by: "motion up to the resonance; or the filter settings of the reference",
        },
        Alias {
            id: "reference-smoothing",
            when: "beside a delay, where the motion has little content near the corner frequency",
            split_by: "sharp steps, or motion up to the corner frequency",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "tau",
    unit: "s",
    says: "time constant of the reference",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.02,
    bounds: (0.0, 0.5),
}];

/// Time constants of the motion before an instant that are looked at; beyond lies 6e-6 of the filter's weight, or less than a thousandth
/// where it is computed in coarse steps.
const REACH: f64 = 12.0;
/// Time constants after which the filter has forgotten what was before to less than a hundredth.
const FORGETS: f64 = 5.0;

impl Effect for ReferenceLag {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Shown(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        let corner = 1.0 / (std::f64::consts::TAU * p[0].value);
        format!(
            "the reference follows the motion slowly, with a time constant of {} (a low-pass filter of {} Hz): it is late, not your gyro",
            p[0].signed("s"),
            units::number(corner)
        )
    }

    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        [0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1, 0.17].iter().map(|&tau| vec![tau]).collect()
    }
}

impl Shown for ReferenceLag {
    /// The filter's own step from one reading to the next, with the motion between them.
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let last = memory.of::<Last>();
        let (tau, rate, apart) = (p[0], s.rate(), s.t - last.t);
        let lags = if last.started == 0.0 || apart < 0.0 {
            -tau * rate
        } else {
            let turned = 0.5 * apart * (rate + last.rate);
            (last.lags - turned) * tau / (tau + apart).max(1e-9)
        };
        *last = Last { lags, rate, t: s.t, started: 1.0 };
        lags
    }

    fn window(&self, p: &[f64], _: f64, apart: f64) -> Window {
        let tau = p[0];
        if tau > 0.0 && tau.is_finite() { Window::first_order(tau, apart, REACH * tau) } else { Window::of_nothing() }
    }

    fn reach(&self, p: &[f64]) -> f64 {
        FORGETS * p[0]
    }
}

/// What it remembers of the reading before.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Last {
    /// What the reference lagged by, rad.
    lags: f64,
    rate: f64,
    t: f64,
    /// 1 after the first reading.
    started: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// sin ωt through the filter with steps `h`, once it has forgotten how it began: K/(1 − (1 − K) e^(−iωh)).
    fn exact(omega: f64, tau: f64, h: f64, t: f64) -> f64 {
        let k = h / (tau + h);
        let (re, im) = (1.0 - (1.0 - k) * (omega * h).cos(), (1.0 - k) * (omega * h).sin());
        let size = re * re + im * im;
        k * (re * (omega * t).sin() - im * (omega * t).cos()) / size
    }

    #[test]
    fn a_sine_is_shown_late_and_smaller_by_the_filters_transfer_function() {
        let tau = 0.02;
        for h in [1e-4, 0.005, 0.01, 0.1] {
            for omega in [1.0, 10.0, 50.0] {
                let t = 0.37;
                let shown = REFERENCE_LAG.window(&[tau], h, h).mean(|u| (omega * (t + u)).sin());
                assert!((shown - exact(omega, tau, h, t)).abs() < 2e-3, "{omega} rad/s, {h} s: {shown}");
            }
        }
        // Slow motion is late by the time constant, however coarse the steps.
        for h in [1e-3, 0.01] {
            let shown = REFERENCE_LAG.window(&[tau], h, h).mean(|u| 1.0 + u);
            assert!((shown - (1.0 - tau)).abs() < 1e-4, "{h}: {shown}");
        }
    }

    #[test]
    fn what_is_taken_out_live_is_what_is_shown() {
        let (tau, omega, h) = (0.05, 6.0_f64, 0.02);
        let mut memory = Memory::default();
        for k in 0..200 {
            let t = f64::from(k) * h;
            let signals = Signals { t, rates: [omega * (omega * t).cos(), 0.0, 0.0], ..Signals::default() };
            let error = REFERENCE_LAG.error(&[tau], &signals, &mut memory);
            if k > 50 {
                let off = exact(omega, tau, h, t) - (omega * t).sin();
                assert!((error - off).abs() < 2e-3, "{k}: {error} for {off}");
            }
        }
    }
}
