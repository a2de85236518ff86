//! `reference-lag`: the reference has a first-order low-pass filter of its own, τ dθ_e/dt + θ_e = θ.
//!
//! Electronics and firmware do it without steps that a log would show. Software computes it once a reading, h apart: θ_e goes on by
//! (θ − θ_e) h/(τ + h). Slow motion is shown late by τ, whatever h is; quick motion loses a little more with such steps.

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
    source: "First-order low-pass filter: transfer function 1/(1 + 2πifτ), or in steps of the implicit Euler method",
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

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "tau",
        unit: "s",
        says: "time constant of the reference",
        role: Role::Shape,
        neutral: 0.0,
        typical: 0.02,
        bounds: (0.0, 0.5),
    },
    ParameterCard {
        name: "step",
        unit: "s",
        says: "time from one step of the filter to the next, where software computes it once a reading; 0 without steps",
        role: Role::Chosen,
        neutral: 0.0,
        typical: 0.0,
        bounds: (0.0, 1.0),
    },
];

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
        [0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1, 0.17].iter().map(|&tau| vec![tau, 0.0]).collect()
    }

    /// Of the two forms the one that `p` does not have, at the time constant that takes as much from quick motion: τ² = τ'² + τ' h.
    fn forms(&self, p: &[f64], span: &Span) -> Vec<Vec<f64>> {
        let (tau, step, half) = (p[0], p[1], 0.5 * span.reference_dt);
        let with_steps = (tau * tau + half * half).sqrt() - half;
        let without = (tau * (tau + step)).sqrt();
        vec![if step > 0.0 { vec![without, 0.0] } else { vec![with_steps, span.reference_dt] }]
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
            let steady = -0.5 * tau * (rate + last.rate);
            steady + (last.lags - steady) * stays(tau, p[1], apart)
        };
        *last = Last { lags, rate, t: s.t, started: 1.0 };
        lags
    }

    fn window(&self, p: &[f64], dt: f64) -> Window {
        let (tau, step) = (p[0], p[1]);
        if !(tau > 0.0 && tau.is_finite()) {
            Window::of_nothing()
        } else if step > 0.0 {
            Window::first_order_in_steps(tau, step, REACH * tau)
        } else {
            Window::first_order(tau, dt.min(tau), REACH * tau)
        }
    }

    fn reach(&self, p: &[f64]) -> f64 {
        FORGETS * p[0]
    }
}

/// Share of a difference that is left after some time: (τ/(τ + h))^(time/h), or e^(−time/τ) without steps.
fn stays(tau: f64, step: f64, time: f64) -> f64 {
    if tau <= 0.0 {
        0.0
    } else if step > 0.0 {
        (tau / (tau + step)).powf(time / step)
    } else {
        (-time / tau).exp()
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

    /// sin ωt through the filter, once it has forgotten how it began: K/(1 − (1 − K) e^(−iωh)) with steps `h`, 1/(1 + iωτ) without.
    fn exact(omega: f64, tau: f64, h: f64, t: f64) -> f64 {
        let k = h / (tau + h);
        let (gain, re, im) = if h > 0.0 {
            (k, 1.0 - (1.0 - k) * (omega * h).cos(), (1.0 - k) * (omega * h).sin())
        } else {
            (1.0, 1.0, omega * tau)
        };
        gain * (re * (omega * t).sin() - im * (omega * t).cos()) / (re * re + im * im)
    }

    #[test]
    fn a_sine_is_shown_late_and_smaller_by_the_filters_transfer_function() {
        let tau = 0.02;
        for (h, dt) in [(1e-4, 0.01), (0.005, 0.01), (0.01, 0.01), (0.1, 0.01), (0.0, 1e-3), (0.0, 0.005)] {
            for omega in [1.0, 10.0, 50.0] {
                let t = 0.37;
                let shown = REFERENCE_LAG.window(&[tau, h], dt).mean(|u| (omega * (t + u)).sin());
                assert!((shown - exact(omega, tau, h, t)).abs() < 4e-3, "{omega} rad/s, {h} s: {shown}");
            }
        }
        // Slow motion is late by the time constant, however coarse the steps.
        for h in [0.0, 1e-3, 0.01] {
            let shown = REFERENCE_LAG.window(&[tau, h], 0.005).mean(|u| 1.0 + u);
            assert!((shown - (1.0 - tau)).abs() < 1e-4, "{h}: {shown}");
        }
    }

    #[test]
    fn what_is_taken_out_live_is_what_is_shown() {
        let (tau, omega, h) = (0.05, 6.0_f64, 0.02);
        for step in [0.0, h] {
            let mut memory = Memory::default();
            for k in 0..200 {
                let t = f64::from(k) * h;
                let signals = Signals { t, rates: [omega * (omega * t).cos(), 0.0, 0.0], ..Signals::default() };
                let error = REFERENCE_LAG.error(&[tau, step], &signals, &mut memory);
                if k > 50 {
                    let off = exact(omega, tau, step, t) - (omega * t).sin();
                    assert!((error - off).abs() < 3e-3, "{k}: {error} for {off}");
                }
            }
        }
    }

    #[test]
    fn each_form_leads_to_the_other_and_back() {
        let span = Span {
            start: 0.0,
            duration: 60.0,
            dt: 0.01,
            reference_dt: 0.01,
            reading_min: 0.0,
            reading_max: 1.0,
            travel: 1.0,
        };
        let there = REFERENCE_LAG.forms(&[0.02, 0.0], &span).remove(0);
        let back = REFERENCE_LAG.forms(&there, &span).remove(0);
        assert!(there[1] == 0.01 && (back[0] - 0.02).abs() < 1e-12 && back[1] == 0.0, "{there:?} {back:?}");
    }
}
