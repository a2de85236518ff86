//! `reference-smoothing`: the reference is a symmetric low-pass of the motion, θ_e = θ ∗ N(0, w²).

use super::{Acts, Alias, Card, Effect, Memory, ParameterCard, Role, Shown, Signals, Span, Window, within};
use crate::Axis;
use crate::measured::Measured;

/// The effect.
pub static REFERENCE_SMOOTHING: ReferenceSmoothing = ReferenceSmoothing;

/// See the file's head.
pub struct ReferenceSmoothing;

static CARD: Card = Card {
    id: "reference-smoothing",
    title: "the reference is smoothed and does not follow fast motion",
    physics: "A camera system fits a curve through its frames, and software takes central differences or a filter without \
              phase. The reference then shows a moving average of the motion, so fast motion comes out too small.",
    equation: "θ_e(t) = ∫ θ(t + u) N(u; 0, w²) du, which is about θ + w²/2 dω/dt",
    typical: "w 5–100 ms (camera systems, central differences)",
    source: "Gaussian filter: transfer function exp(−(2πf w)²/2)",
    needs: &[],
    excited_by: "motion at frequencies near 1/(2πw)",
    mended_by: "the model is compared with the reference as smoothed; live, w²/2 dω/dt is taken out of the reference",
    at_source: "switch off the smoothing of the reference, or raise its cut-off, in the camera system's or the logger's settings",
    traits: &[],
    simpler: &[],
    aliases: &[
        Alias {
            id: "mount-resonance",
            when: "the motion stays far below the resonance: both raise the gyro's rate with the square of the frequency",
            split_by: "motion up to the resonance; or the filter settings of the reference",
        },
        Alias {
            id: "cubic-nonlinearity",
            when: "the motion is fast only where it is large",
            split_by: "a slower and a faster motion of the same amplitude",
        },
        Alias {
            id: "reference-lag",
            when: "beside a delay, where the motion has little content near the corner frequency",
            split_by: "sharp steps, or motion up to the corner frequency",
        },
    ],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "w",
    unit: "s",
    says: "standard deviation of the window",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.02,
    bounds: (0.0, 0.5),
}];

/// Standard deviations of the window that are looked at on either side; beyond lies 6e-5 of its weight.
const REACH: f64 = 4.0;
/// Instants in one standard deviation: at least, and at most. Two give the integral of motion slower than 2/w rad/s to 1e-8. With eight,
/// motion fast enough to fall between the instants is too small an angle to matter.
const FEWEST: f64 = 2.0;
const MOST: f64 = 8.0;

impl Effect for ReferenceSmoothing {
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
        format!("the reference is smoothed by a window of {} (standard deviation)", p[0].size("s"))
    }

    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        [0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035, 0.06, 0.1, 0.17].iter().map(|&w| vec![w]).collect()
    }
}

impl Shown for ReferenceSmoothing {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        0.5 * p[0] * p[0] * s.rate_dot
    }

    fn window(&self, p: &[f64], dt: f64) -> Window {
        let w = p[0];
        if !(w > 0.0 && w.is_finite()) {
            return Window::of_nothing();
        }
        Window::gaussian(w, within(dt, w / MOST, w / FEWEST), REACH * w)
    }

    fn reach(&self, p: &[f64]) -> f64 {
        REACH * p[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_is_shown_smaller_by_the_gaussian_transfer_function() {
        let w = 0.02;
        for dt in [1e-4, 0.005, 0.01, 0.1] {
            for omega in [1.0, 10.0, 50.0] {
                let t = 0.37;
                let shown = REFERENCE_SMOOTHING.window(&[w], dt).mean(|u| (omega * (t + u)).sin());
                let exact = (-0.5 * (omega * w).powi(2)).exp() * (omega * t).sin();
                assert!((shown - exact).abs() < 2e-4, "{omega} rad/s, {dt} s: {shown} for {exact}");
            }
        }
    }

    #[test]
    fn what_is_taken_out_live_is_what_is_shown_of_slow_motion() {
        let (w, omega, t) = (0.02, 5.0_f64, 0.1);
        let shown = REFERENCE_SMOOTHING.window(&[w], 0.005).mean(|u| (omega * (t + u)).sin());
        let signals = Signals { rate_dot: -omega * omega * (omega * t).sin(), ..Signals::default() };
        let error = REFERENCE_SMOOTHING.error(&[w], &signals, &mut Memory::default());
        assert!((shown - (omega * t).sin() - error).abs() < 0.01 * error.abs());
    }
}
