//! `rate-hysteresis`: the output depends on the direction of change, a play operator of width h on ω.

mod turn;

use self::turn::{Reading, TURN, Turn, Way};
use super::{Acts, Card, Effect, ErrorWhole, Felt, Memory, ParameterCard, Role, Signals, Span, play};
use crate::Axis;
use crate::measured::Measured;
use std::borrow::Cow;

/// The effect.
pub static RATE_HYSTERESIS: RateHysteresis = RateHysteresis;

/// See the file's head.
pub struct RateHysteresis;

static CARD: Card = Card {
    id: "rate-hysteresis",
    title: "the reading depends on whether the rate rises or falls",
    physics: "Friction in the suspension or charge in the dielectric holds the output back until the rate has changed \
             by h, at every reversal of the acceleration.",
    equation: "ω_f = P_h(ω): stands still until ω has left the clearance ±h/2 about it",
    typical: "0.01–0.5 °/s",
    source: "IEEE Std 1431, hysteresis error; play operator",
    needs: &[],
    excited_by: "reversals of the acceleration, several amplitudes, a rate that keeps changing",
    mended_by: "well, where noise is smaller than h",
    at_source: "nothing: it is a property of the part. Keep the correction, or use another part",
    traits: &[],
    simpler: &[],
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

/// −h/2 while the rate goes up, +h/2 while it goes down, and between them the passage through the play ([`Turn`]). Before it first
/// turns the error is unsure. While the reading stands still the rate is held, where it came to or, wandering within the play,
/// somewhere else.
fn passages(h: f64, t: &[f64], felt: &[f64]) -> ErrorWhole {
    let [mut unsure, mut held] = [(); 2].map(|()| vec![false; t.len()]);
    let mut error = vec![0.0; t.len()];
    if h <= 0.0 || t.len() < 3 {
        return ErrorWhole { error, unsure, held };
    }
    let reading = Reading::through(h, t, felt);
    let first = reading.first_way();
    unsure[1..first.map_or(t.len(), |way| way.since + 1)].fill(true);
    if let Some(mut way) = first {
        for k in way.since + 1..t.len() {
            let level = -0.5 * h * way.sign;
            error[k] = level;
            if way.goes_on(reading.level[k], k) || !reading.has_turned(&way, k) {
                continue;
            }
            let turn = Turn::of(&reading, &way, k);
            for i in (way.since + 1..=k).rev().take_while(|&i| t[i] > turn.from) {
                error[i] = level * (1.0 - 2.0 * turn.share(t[i]));
            }
            way = Way { sign: -way.sign, since: k, extreme: reading.level[k], at: k };
        }
    }
    for still in reading.stands() {
        held[still].fill(true);
    }
    ErrorWhole { error, unsure, held }
}

/// What compensation does, in C.
const IN_C: &str = "\
const double turn = 0.5 * h, half = 0.5 * turn;
if (!(turn > 0.0)) {
    return 0.0;
}
if (memory[6] == 0.0) {
    memory[6] = 1.0;
    memory[0] = in->rate;
}
memory[0] = fmin(fmax(memory[0], in->rate - half), in->rate + half);
return (memory[0] - in->rate) / 0.5;";

impl Effect for RateHysteresis {
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
        format!(
            "your gyro's reading depends on whether the rate came from above or from below: it stays {} behind when the rate begins to rise or to fall",
            p[0].size("rad/s")
        )
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some(IN_C.into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let end = (0.3 * span.reading_max).min(0.5);
        std::iter::successors(Some(3e-4), |h| Some(h * 1.6)).take_while(|&h| h <= end).map(|h| vec![h]).collect()
    }
}

impl Felt for RateHysteresis {
    fn error(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        play(p[0], s.rate(), memory.of()) - s.rate()
    }

    /// Inside the play the reading stands still whatever the rate does, so P_h has no inverse. Where the rate has turned
    /// is seen from a narrower play that it has crossed: −h/2 going up, +h/2 going down.
    fn error_seen(&self, p: &[f64], s: &Signals, memory: &mut Memory) -> f64 {
        let turn = TURN * p[0];
        if turn > 0.0 { (play(turn, s.rate(), memory.of()) - s.rate()) / TURN } else { 0.0 }
    }

    fn is_play(&self) -> bool {
        true
    }

    fn error_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> ErrorWhole {
        passages(p[0], t, felt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Motion, Shaft};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Readings of a motion through the play, at times t: `(t, felt, error)`.
    fn readings(motion: Motion, rate: f64, seconds: f64, h: f64, density: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let fine = 10;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut shaft = Shaft::new(motion, 1);
        let mut memory = Memory::default();
        let (mut t, mut felt, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..(seconds * rate) as usize * fine {
            let at = k as f64 / rate / fine as f64;
            let true_rate = shaft.at(at).rate;
            let error =
                RATE_HYSTERESIS.error(&[h], &Signals { rates: [true_rate; 3], ..Signals::default() }, &mut memory);
            if k % fine == 0 {
                let noise: f64 = StandardNormal.sample(&mut rng);
                t.push(at);
                felt.push(true_rate + error + density * f64::sqrt(rate) * noise);
                truth.push(error);
            }
        }
        (t, felt, truth)
    }

    /// What a drive's angle is off by at most where the error counts as known, over what white noise alone walks.
    fn off(h: f64, density: f64) -> f64 {
        off_while(Motion::Drive { rate: 1.2, hold: 2.0 }, h, density, |whole, k| !whole.held[k])
    }

    /// The same of any motion where `counts`.
    fn off_while(motion: Motion, h: f64, density: f64, counts: impl Fn(&ErrorWhole, usize) -> bool) -> f64 {
        let (rate, seconds) = (100.0, 60.0);
        let (t, felt, truth) = readings(motion, rate, seconds, h, density);
        let whole = passages(h, &t, &felt);
        let known = (0..t.len()).filter(|&k| !whole.unsure[k] && counts(&whole, k));
        let steps = known.map(|k| (whole.error[k] - truth[k]) / rate);
        let walk = steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(f64::abs(*sum))
        });
        walk.fold(0.0, f64::max) / (density * f64::sqrt(seconds))
    }

    /// How late a rate counts as turned, in the mean, s: what the angle is off by, the same way at every turn, over h.
    fn late(motion: Motion, h: f64, rate: f64, density: f64) -> f64 {
        let (t, felt, truth) = readings(motion, rate, 60.0, h, density);
        let whole = passages(h, &t, &felt);
        let (mut off, mut turns) = (0.0, 0.0);
        let about = (0.05 * rate) as usize;
        for k in about..t.len() - about {
            // The error goes from −h/2 to h/2 where the rate peaks, and back at its troughs.
            let peak = (felt[k] - 0.5 * (felt[k - about] + felt[k + about])).signum();
            off += peak * (truth[k] - whole.error[k]) / rate;
            turns += (truth[k] - truth[k - 1]).abs() / h;
        }
        off / h / turns
    }

    #[test]
    fn a_reading_as_noisy_as_the_play_is_wide_shows_which_way_it_goes() {
        assert!(off(1e-3, 1e-4) < 1.0 && off(6e-3, 1e-4) < 1.0, "{} {}", off(1e-3, 1e-4), off(6e-3, 1e-4));
    }

    #[test]
    fn a_rate_that_creeps_before_it_turns_is_not_taken_for_a_long_passage() {
        assert!(off(6e-3, 1e-5) < 2.0 && off(0.02, 1e-5) < 2.0, "{} {}", off(6e-3, 1e-5), off(0.02, 1e-5));
    }

    #[test]
    fn the_noise_of_a_reading_that_stands_does_not_turn_the_rate() {
        let table = Motion::RateTable { rate: 2.0, hold: 4.0 };
        for (h, density) in [(3e-3, 1e-4), (5e-3, 2e-4), (0.02, 2e-4)] {
            let off = off_while(table, h, density, |_, _| true);
            assert!(off < 1.5, "{off}: {h} rad/s, {density} rad/√s");
        }
    }

    #[test]
    fn a_peak_tells_when_the_rate_turned_however_noisy_and_short() {
        let sine = Motion::Sine { amplitude: 2.5, frequency: 0.4 };
        let multisine = Motion::Multisine { travel: 6.0 };
        for (motion, h, rate, density) in [
            (sine, 0.02, 250.0, 1e-5),
            (sine, 0.02, 250.0, 1e-4),
            (sine, 0.01, 500.0, 1e-4),
            (multisine, 0.03, 100.0, 1e-4),
            (multisine, 0.03, 500.0, 1e-4),
        ] {
            let late = late(motion, h, rate, density);
            assert!(late.abs() < 2e-3, "{late} s: {motion:?}, {h} rad/s at {rate} Hz, {density} rad/√s");
        }
    }
}
