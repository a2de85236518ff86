//! `encoder-backlash`: play between shaft and encoder, a play operator of width b on θ.

use super::{Acts, Card, Effect, Memory, Need, ParameterCard, Play, ReferenceAngle, Role, Signals, Span, play, within};
use crate::Axis;
use crate::measured::Measured;
use bytemuck::{Pod, Zeroable};

/// The effect.
pub static ENCODER_BACKLASH: EncoderBacklash = EncoderBacklash;

/// See the file's head.
pub struct EncoderBacklash;

static CARD: Card = Card {
    id: "encoder-backlash",
    title: "play between shaft and encoder",
    physics: "A coupling or gear with clearance lets the shaft turn by b before the encoder follows, at every \
              reversal.",
    equation: "θ_e = P_b(θ): the encoder stands still until the shaft has left the clearance ±b/2 about it",
    typical: "0.1–2°",
    source: "play (backlash) operator; gear and coupling data sheets",
    needs: &[Need::AngleReference],
    excited_by: "reversals",
    mended_by: "taken out of the reference",
    at_source: "take the play out: fix the encoder to the shaft itself, without coupling or gear",
    traits: &[],
    simpler: &[],
    aliases: &[],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "b",
    unit: "rad",
    says: "width of the clearance",
    role: Role::Shape,
    neutral: 0.0,
    typical: 0.01,
    bounds: (0.0, 0.5),
}];

impl Effect for EncoderBacklash {
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
        format!("the encoder has {} of play against the shaft", p[0].size("rad"))
    }

    fn grid(&self, _: &Span) -> Vec<Vec<f64>> {
        [3e-5, 1e-4, 3e-4, 0.001, 0.002, 0.004, 0.007, 0.012, 0.02, 0.035].iter().map(|&b| vec![b]).collect()
    }
}

impl ReferenceAngle for EncoderBacklash {
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let (half, gear) = (0.5 * p[0], memory.of::<Gear>());
        if gear.play.started == 0.0 {
            [gear.least, gear.most] = [s.angle - half, s.angle + half];
        }
        for end in [&mut gear.least, &mut gear.most] {
            *end = within(*end, s.angle - half, s.angle + half);
        }
        play(p[0], s.angle, &mut gear.play) - s.angle
    }

    fn is_guess(&self, p: &[f64], memory: &Memory) -> bool {
        let gear = memory.seen::<Gear>();
        gear.most - gear.least > 1e-6 * p[0]
    }

    /// Between the stops the shaft turns and the encoder stands.
    fn silent(&self, p: &[f64], error: f64) -> bool {
        error.abs() < 0.5 * p[0] * (1.0 - 1e-6)
    }
}

/// What it remembers.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Gear {
    play: Play,
    /// Between these the encoder may stand, rad: nobody knows where in the clearance a log begins.
    least: f64,
    most: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_a_gear_stands_is_known_once_its_clearance_is_passed() {
        let (p, mut memory) = ([0.01], Memory::default());
        let mut is_guess_at = |angle: f64| {
            let signals = Signals { angle, ..Signals::default() };
            ENCODER_BACKLASH.error(&p, &signals, &mut memory);
            ENCODER_BACKLASH.is_guess(&p, &memory)
        };
        assert!([0.0, 0.004, 0.002, -0.005].into_iter().all(&mut is_guess_at), "it went through 0.009 of 0.01");
        assert!(!is_guess_at(-0.0061) && !is_guess_at(0.0), "and then through more");
    }
}
