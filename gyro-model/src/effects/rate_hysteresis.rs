//! `rate-hysteresis`: the output depends on the direction of change, a play operator of width h on ω.

use super::{Card, Effect, ErrorWhole, Memory, ParameterCard, Role, Signals, Span, Stage, play, quieted};
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

/// −h/2 while the rate goes up, +h/2 while it goes down, and between them the passage through the play.
///
/// The reading lets go of its extreme P when the rate has come back by h, and falls from there with slope v. The rate left
/// its own extreme earlier: on a parabola 2h/v before, along a straight ramp h/v. An even peak is left as it was reached, which
/// tells where between the two; the quadratic through both ends with slope v at the later one is exact for either. But a
/// rate that is held, and wanders within the play, shows nothing of it: while the reading stands still, and before it first
/// turns, the error is unsure.
fn passages(h: f64, t: &[f64], felt: &[f64]) -> ErrorWhole {
    let (mut error, mut unsure) = (vec![0.0; t.len()], vec![false; t.len()]);
    if h <= 0.0 || t.len() < 3 {
        return ErrorWhole { error, unsure };
    }
    let (s, noise) = quieted(t, felt);
    // By how much the rate has to come back before it counts as turned: below it, noise would turn it.
    let back = (TURN * h).max(SURE * noise);
    // Where the steadied reading, going back from `k`, was last on the other side of that depth below the extreme.
    let crossing = |extreme: f64, sign: f64, depth: f64, k: usize, from: usize| -> f64 {
        let below = |i: usize| sign * (extreme - s[i]) - depth;
        let other = |i: &usize| (below(*i) > 0.0) != (below(k) > 0.0);
        let i = (from..k).rev().find(other).unwrap_or(from);
        let (a, b) = (below(i), below(i + 1));
        t[i] + (a / (a - b)).clamp(0.0, 1.0) * (t[i + 1] - t[i])
    };
    let (mut sign, mut extreme, mut at, mut since, mut level) = (0.0, s[0], 0, 0, 0.0);
    let (mut low, mut high) = (s[0], s[0]);
    for k in 1..t.len() {
        if sign == 0.0 {
            (low, high) = (low.min(s[k]), high.max(s[k]));
            if high - low > back {
                sign = if s[k] >= high { 1.0 } else { -1.0 };
                (extreme, at, since, level) = (s[k], k, k, -0.5 * h * sign);
            }
            unsure[k] = true;
            continue;
        }
        error[k] = level;
        if sign * (s[k] - extreme) >= 0.0 {
            (extreme, at) = (s[k], k);
        } else if sign * (extreme - s[k]) > back {
            let (early, late) =
                (crossing(extreme, sign, 0.3 * back, k, since), crossing(extreme, sign, back, k, since));
            let v = 0.7 * back / (late - early).max(1e-9);
            let let_go = (late - back / v).max(t[at]);
            // About as long as it took to come as near on the way there, as any even peak; not longer than a parabola.
            let came = crossing(extreme, sign, h.max(back), at, since);
            let first = (0.5 * (came + let_go)).max(let_go - 2.0 * h / v).max(came);
            let bend = (v * (let_go - first) / h).clamp(1.0, 2.0) - 1.0;
            let mut i = k;
            while i > since && t[i] > first {
                let x = ((t[i] - first) / (let_go - first).max(1e-9)).clamp(0.0, 1.0);
                error[i] = level * (1.0 - 2.0 * x * (1.0 - bend + bend * x));
                i -= 1;
            }
            (sign, extreme, at, since, level) = (-sign, s[k], k, k, -level);
        }
    }
    // Where the reading stays about one value, the rate may be anywhere within the play.
    let near = (NEAR * h).max(SURE * noise);
    let mut from = 0;
    for k in 1..=t.len() {
        if k == t.len() || (s[k] - s[from]).abs() > near {
            if t[k - 1] - t[from] > DWELL {
                unsure[from..k].fill(true);
            }
            from = k;
        }
    }
    ErrorWhole { error, unsure }
}

/// Share of h within which the reading counts as standing still, and for how long, s.
const NEAR: f64 = 0.3;
const DWELL: f64 = 0.05;

/// Share of h by which the rate has to come back before it counts as turned.
const TURN: f64 = 0.5;
/// Standard deviations of the steadied reading's noise that noise alone hardly goes.
const SURE: f64 = 5.0;

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

    fn error_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> Option<ErrorWhole> {
        Some(passages(p[0], t, felt))
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let end = (0.3 * span.reading_max).min(0.5);
        std::iter::successors(Some(3e-4), |h| Some(h * 1.6)).take_while(|&h| h <= end).map(|h| vec![h]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Motion, Shaft};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// What a drive's angle is off by at most where the error counts as known, over what white noise alone walks.
    fn off(h: f64, density: f64) -> f64 {
        let (rate, seconds, fine) = (100.0, 60.0, 10);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut shaft = Shaft::new(Motion::Drive { rate: 1.2, hold: 2.0 }, 1);
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
        let whole = passages(h, &t, &felt);
        let steps = (0..t.len()).filter(|&k| !whole.unsure[k]).map(|k| (whole.error[k] - truth[k]) / rate);
        let walk = steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(f64::abs(*sum))
        });
        walk.fold(0.0, f64::max) / (density * f64::sqrt(seconds))
    }

    #[test]
    fn a_reading_as_noisy_as_the_play_is_wide_shows_which_way_it_goes() {
        assert!(off(1e-3, 1e-4) < 1.0 && off(6e-3, 1e-4) < 1.0, "{} {}", off(1e-3, 1e-4), off(6e-3, 1e-4));
    }

    #[test]
    fn a_rate_that_creeps_before_it_turns_is_not_taken_for_a_long_passage() {
        assert!(off(6e-3, 1e-5) < 2.0 && off(0.02, 1e-5) < 2.0, "{} {}", off(6e-3, 1e-5), off(0.02, 1e-5));
    }
}
