//! `lost-counts`: an encoder's counter cannot follow and loses counts while the shaft turns faster than some rate,
//! θ_e = θ − s ∫ ω dt over the times with |ω| > w, with s the share that is lost (`loss`) and w that rate (`above`).
//!
//! An interrupt that is late misses a share of all edges from that rate on; a counter that is full misses what is beyond it,
//! ω − w sgn ω in place of ω.

use super::{Acts, Alias, Card, Effect, Memory, Need, ParameterCard, ReferenceAngle, Role, Signals, Span};
use crate::Axis;
use crate::measured::Measured;
use bytemuck::{Pod, Zeroable};

/// The effect.
pub static LOST_COUNTS: LostCounts = LostCounts;

/// See the file's head.
pub struct LostCounts;

static CARD: Card = Card {
    id: "lost-counts",
    title: "the encoder loses counts above a rate",
    physics: "An interrupt or a counter that cannot follow misses edges while the shaft turns faster than some rate. Below it encoder \
              and gyro agree, above it the encoder shows too little, whichever way the shaft turns.",
    equation: "θ_e = θ − loss ∫ ω dt over the times with |ω| > above; with beyond = 1, ω − above sgn ω in place of ω",
    typical: "0.3–50 % of the counts above some rate",
    source: "Quadrature decoding by interrupts: edges that come faster than they are served are not counted",
    needs: &[Need::AngleReference],
    excited_by: "rates below and above that rate, in both directions",
    mended_by: "taken out of the reference",
    at_source: "count in hardware (a timer's encoder mode), or turn more slowly",
    traits: &[],
    simpler: &[],
    aliases: &[Alias {
        id: "cubic-nonlinearity",
        when: "the shaft turns at few rates: with both the gyro reads more than the encoder where it is fast",
        split_by: "a slow ramp through all rates: counts are lost from one rate on, a curve has no such rate; or a counter in hardware",
    }],
};

static PARAMETERS: [ParameterCard; 3] = [
    ParameterCard {
        name: "loss",
        unit: "1",
        says: "share of the counts that is lost",
        role: Role::Linear,
        neutral: 0.0,
        typical: 0.02,
        bounds: (0.0, 1.0),
    },
    ParameterCard {
        name: "above",
        unit: "rad/s",
        says: "rate above which counts are lost",
        role: Role::Shape,
        neutral: 2.0,
        typical: 2.0,
        bounds: (0.0, 1e3),
    },
    ParameterCard {
        name: "beyond",
        unit: "1",
        says: "0: the share of all counts while it is faster; 1: of what is beyond that rate",
        role: Role::Chosen,
        neutral: 0.0,
        typical: 0.0,
        bounds: (0.0, 1.0),
    },
];

impl Effect for LostCounts {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Reference(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        let of = if p[2].value > 0.5 { "what is beyond" } else { "its counts above" };
        format!("the encoder loses {} of {of} {}", p[0].size("1"), p[1].size("rad/s"))
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let shares = [0.25, 0.35, 0.45, 0.54, 0.62, 0.69, 0.75, 0.8, 0.85, 0.89, 0.93, 0.96];
        shares.iter().map(|share| vec![share * span.reading_max, 0.0]).collect()
    }

    /// Of the two forms the one that `p` does not have, about as much lost at the same rates.
    fn forms(&self, p: &[f64], _: &Span) -> Vec<Vec<f64>> {
        vec![vec![p[0], p[1], if p[2] > 0.5 { 0.0 } else { 1.0 }]]
    }
}

impl ReferenceAngle for LostCounts {
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let (last, rate) = (memory.of::<Last>(), s.rate());
        let apart = if last.started == 0.0 { 0.0 } else { (s.t - last.t).max(0.0) };
        let turned = last.turned + apart * mean_while_fast(last.rate, rate, p[1], p[2] > 0.5);
        *last = Last { turned, rate, t: s.t, started: 1.0 };
        -p[0] * turned
    }
}

/// The mean of the rate, or of what is `beyond` w of it, over the times with |ω| > w, while the rate goes evenly from `a` to `b`; 0 at the
/// other times:
///
/// ```text
/// (G(b) − G(a))/(b − a),   G(ω) = (ω² − w²)/2, or (|ω| − w)²/2, where |ω| > w, else 0
/// ```
fn mean_while_fast(a: f64, b: f64, w: f64, beyond: bool) -> f64 {
    let integral = |rate: f64| match rate.abs() - w {
        over if over <= 0.0 => 0.0,
        over if beyond => 0.5 * over * over,
        over => 0.5 * over * (rate.abs() + w),
    };
    let middle = 0.5 * (a + b);
    if (b - a).abs() > EVEN * (a.abs() + b.abs()) {
        (integral(b) - integral(a)) / (b - a)
    } else if middle.abs() <= w {
        0.0
    } else if beyond {
        middle - w.copysign(middle)
    } else {
        middle
    }
}

/// A change of the rate, as a share of it, that is none.
const EVEN: f64 = 1e-9;

/// What it remembers.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Last {
    /// What the shaft turned while it was fast, rad.
    turned: f64,
    rate: f64,
    t: f64,
    /// 1 after the first reading.
    started: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_what_is_turned_above_the_rate_is_lost() {
        let after = |p: [f64; 3]| {
            let mut memory = Memory::default();
            let at = |k: u32| {
                let t = 1e-3 * f64::from(k);
                let signals = Signals { t, rates: [3.0 * t.sin(), 0.0, 0.0], ..Signals::default() };
                LOST_COUNTS.error(&p, &signals, &mut memory)
            };
            (0..=1571).map(at).last().unwrap()
        };
        // A quarter of a sine of 3 rad/s: above 2 rad/s from t = asin(2/3) on.
        let begins = (2.0_f64 / 3.0).asin();
        let all = 3.0 * begins.cos();
        let beyond = all - 2.0 * (std::f64::consts::FRAC_PI_2 - begins);
        assert!(
            (after([0.1, 2.0, 0.0]) + 0.1 * all).abs() < 1e-4 && (after([0.1, 2.0, 1.0]) + 0.1 * beyond).abs() < 1e-4
        );
        assert!(after([0.1, 4.0, 0.0]) == 0.0);
    }

    #[test]
    fn where_a_step_passes_the_rate_the_loss_goes_smoothly_with_it() {
        for beyond in [false, true] {
            let at = |w: f64| mean_while_fast(-1.0, 3.0, w, beyond);
            let slopes: Vec<f64> =
                (1..40).map(|k| 0.1 + 0.07 * f64::from(k)).map(|w| (at(w + 1e-6) - at(w)) / 1e-6).collect();
            assert!(slopes.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.3), "{slopes:?}");
            assert!((mean_while_fast(3.0, 3.0, 2.0, beyond) - mean_while_fast(3.0, 3.001, 2.0, beyond)).abs() < 1e-3);
        }
    }
}
