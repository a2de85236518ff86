//! `rate-hysteresis`: the output depends on the direction of change, a play operator of width h on ω.

use super::{Card, Effect, Memory, ParameterCard, Role, Signals, Span, Stage, play};
use crate::Axis;

/// The effect.
pub static RATE_HYSTERESIS: RateHysteresis = RateHysteresis;

/// See the file's head.
pub struct RateHysteresis;

static CARD: Card = Card {
    id: "rate-hysteresis",
    title: "hysteresis in rate",
    physics: "Friction in the suspension or charge in the dielectric holds the output back until the rate has \
              changed by h, at every turn of the acceleration.",
    equation: "ω_f = P_h(ω): stands still until ω has left the clearance ±h/2 about it",
    typical: "0.01–0.5 °/s",
    source: "IEEE Std 1431, hysteresis error; play operator",
    needs: &[],
    excited_by: "reversals of the acceleration, several amplitudes",
    mended_by: "well, where noise is smaller than h",
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "h",
    unit: "rad/s",
    says: "width of the clearance",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.01,
    bounds: (0.0, 0.5),
}];

/// Share of h by which the rate has to come back before it counts as turned: below it, noise would turn it.
const TURN: f64 = 0.5;

impl Effect for RateHysteresis {
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
        play(p[0], s.rate(), memory) - s.rate()
    }

    /// Inside the play the reading stands still whatever the rate does, so P_h has no inverse. Where the rate has turned
    /// is seen from a narrower play that it has crossed: −h/2 going up, +h/2 going down.
    fn error_seen(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let turn = TURN * p[0];
        if turn > 0.0 { (play(turn, s.rate(), memory) - s.rate()) / TURN } else { 0.0 }
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let end = (0.3 * span.reading_max).min(0.5);
        std::iter::successors(Some(0.002), |h| Some(h * 1.6)).take_while(|&h| h <= end).map(|h| vec![h]).collect()
    }
}
