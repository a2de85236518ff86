//! `scale-asymmetry`: turns one way and the other have different scales, φ = |ω|.

use super::{Acts, Alias, Card, Effect, Felt, Memory, ParameterCard, Role, Signals};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static SCALE_ASYMMETRY: ScaleAsymmetry = ScaleAsymmetry;

/// See the file's head.
pub struct ScaleAsymmetry;

static CARD: Card = Card {
    id: "scale-asymmetry",
    title: "reads one direction of turning more than the other",
    physics: "Positive and negative rates go through different halves of the sense electronics, so the two \
              directions scale differently. During turns to and fro the angle drifts although the bias is right.",
    equation: "ω_f = ω + a |ω|",
    typical: "50–600 ppm in data sheets, up to 1 % on cheap parts",
    source: "IEEE Std 1431, scale factor asymmetry",
    needs: &[],
    excited_by: "both directions, several amplitudes",
    mended_by: "exactly, by iteration in the compensated rate",
    at_source: "nothing: it is a property of the part. Keep the correction, or use another part",
    traits: &[],
    simpler: &[],
    aliases: &[Alias {
        id: "quadratic-nonlinearity",
        when: "the motion has one amplitude",
        split_by: "several amplitudes: scale-asymmetry has a kink at zero rate, quadratic-nonlinearity is a smooth curve",
    }],
};

static PARAMETERS: [ParameterCard; 1] = [ParameterCard {
    name: "a",
    unit: "1",
    says: "half the difference between the two scales",
    role: Role::Linear,
    neutral: 0.0,
    typical: 3e-3,
    bounds: (-0.2, 0.2),
}];

impl Effect for ScaleAsymmetry {
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
        let (more, less) = if p[0].value > 0.0 { ("positive", "negative") } else { ("negative", "positive") };
        format!(
            "your gyro reads {} too much when it turns in the {more} direction, and as much too little in the {less} one",
            p[0].size("1")
        )
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some("return a * fabs(in->rate);".into())
    }
}

impl Felt for ScaleAsymmetry {
    fn error(&self, p: &[f64], s: &Signals, _: &mut Memory) -> f64 {
        p[0] * s.rate().abs()
    }
}
