//! Which suspect comes first, and what this log cannot tell apart.

use super::{
    gate::SHARE,
    refit::{DRAWS, Present, Refit, mean, total},
    verdict::is_slow,
};
use crate::{
    Axis,
    effects::are_aliases,
    evidence::{
        draws::Draws,
        noise::{self, BLOCKS},
        prior::untrended,
    },
    nls::{self, dot},
};
use std::{f64::consts::SQRT_2, ops::Range};

/// By the held-out error where that tells them apart, else by the held-out likelihood, which tells more finely.
pub(super) fn rank(refits: &mut Vec<Refit>) {
    let mut left = std::mem::take(refits);
    while let Some(lowest) = left.iter().min_by(|a, b| a.excess.total_cmp(&b.excess)) {
        let close = |r: &Refit| {
            let nearly = lowest.excess.max(r.excess) < ROUGH;
            let (mean, spread) = lowest.against(r);
            r.excess <= lowest.excess || nearly && (r.excess <= lowest.excess * (1.0 + CLOSE) || mean < 2.0 * spread)
        };
        let best = (0..left.len())
            .filter(|&k| close(&left[k]))
            .max_by(|&a, &b| left[a].held_out.0.total_cmp(&left[b].held_out.0))
            .unwrap_or(0);
        refits.push(left.remove(best));
    }
}

/// Drops a resonance where a tone that it takes out does as well: what the motion sets ringing does not ring in one phase
/// throughout the log, while the inverse of a resonance is a notch, which takes out any line.
pub(super) fn drop_driven(refits: &mut Vec<Refit>) {
    let is = |r: &Refit, id: &str| r.candidate.term.effect.card().id == id;
    let frequency = |r: &Refit| {
        let cards = r.candidate.term.effect.parameters(Axis::X);
        cards.iter().position(|card| card.unit == "Hz").map_or(f64::NAN, |k| r.candidate.term.values[k])
    };
    let (mut resonances, others): (Vec<Refit>, Vec<Refit>) =
        std::mem::take(refits).into_iter().partition(|r| is(r, "mount-resonance"));
    let drives = |tone: &Refit, r: &Refit| {
        is(tone, "vibration-tone")
            && tone.candidate.series == r.candidate.series
            && TAKEN_OUT.contains(&(frequency(tone) / frequency(r)))
            && (tone.equals(r) || tone.does_nearly_as_well(r))
    };
    resonances.retain(|r| !others.iter().any(|tone| drives(tone, r)));
    *refits = others;
    refits.append(&mut resonances);
}

/// Frequencies, over its own, of lines that the inverse of a resonance makes much smaller or turns over: it multiplies them by
/// 1 − (f/f₀)², but for the damping.
const TAKEN_OUT: Range<f64> = 0.5..SQRT_2;

/// Puts before the best what cannot be told from it and is plainer: fewer parameters, or a measured channel instead of
/// a free shape, for one more at most.
pub(super) fn prefer_plainer(refits: &mut [Refit], present: &Present) {
    let Some(best) = refits.first() else { return };
    let plainer = (1..refits.len()).find(|&k| {
        let r = &refits[k];
        let (own, other) = (r.candidate.freedom, best.candidate.freedom);
        let simpler =
            own < other || r.goes_with_what_is_measured() && !best.goes_with_what_is_measured() && own <= other + 1;
        r.candidate.series == best.candidate.series
            && simpler
            && (r.significant() || r.passes(present))
            && (best.alike(r) || best.hardly_beats(r))
    });
    if let Some(k) = plainer {
        refits[..=k].rotate_right(1);
    }
}

impl Refit<'_> {
    /// Whether this log cannot tell it from `other`: both their held-out likelihoods and their held-out errors differ by
    /// less than two standard errors over the blocks, or by less than either is found to. What noise alone raises a
    /// likelihood by, it makes two of them differ by too.
    #[must_use]
    pub fn alike(&self, other: &Refit) -> bool {
        self.leaves_as_much_as(other)
            && (self.is_as_likely_as(other) && self.errs_as_much_as(other)
                || self.is_likelier_by_steps(other)
                || self.is_at_odds_with(other))
    }

    /// Whether what one of two that are nearly right is likelier by is what an encoder's steps may make of a motion that repeats
    /// itself: they come again in every period, as harmonics do, and are no noise that evens out.
    fn is_likelier_by_steps(&self, other: &Refit) -> bool {
        let (better, worse) = if self.rise > other.rise { (self, other) } else { (other, self) };
        better.excess.max(worse.excess) < ROUGH
            && better.raises_on_steps_beside(worse).is_some_and(|most| better.rise - worse.rise < most)
    }

    /// Whether one is likelier and the other one errs less on one exact sine, where only one leaves samples out: their likelihoods are
    /// of different samples.
    fn is_at_odds_with(&self, other: &Refit) -> bool {
        let series = &self.study.bench.problem.series[self.candidate.series];
        series.one_line.is_some()
            && self.study.leaves_out() != other.study.leaves_out()
            && self.excess.max(other.excess) < ROUGH
            && (self.rise > other.rise) == (self.excess > other.excess)
    }

    /// What ln L rises by at most where this effect joins `other` on draws of noise alone; `None` where the motion does not
    /// repeat itself.
    fn raises_on_steps_beside(&self, other: &Refit) -> Option<f64> {
        let series = self.candidate.series;
        self.study.bench.problem.series[series].one_line?;
        let noise_alone = Draws::where_seen(&other.study, series)?;
        let whitener = noise::whitener(&other.study, &other.gls.noise);
        let white = |column: &Vec<Vec<f64>>| whitener.apply_each(column);
        let beside: Vec<Vec<Vec<f64>>> = other.study.columns.iter().map(white).collect();
        let last = self.study.slots.iter().map(|slot| slot.term).max()?;
        let own = self.study.slots.iter().zip(&self.study.columns).filter(|(slot, _)| slot.term == last);
        let all: Vec<Vec<Vec<f64>>> = beside.iter().cloned().chain(own.map(|(_, column)| white(column))).collect();
        let rise = |columns: &[Vec<Vec<f64>>], draw: &[Vec<f64>]| {
            let mut normal = nls::Normal::zeros(columns.len());
            for (channel, residual) in draw.iter().enumerate() {
                normal.add(residual, &columns.iter().map(|c| c[channel].as_slice()).collect::<Vec<_>>());
            }
            normal.rise(1e-10).0
        };
        let gains = (0..DRAWS)
            .map(|seed| whitener.apply_each(&noise_alone.read(seed)))
            .map(|draw| rise(&all, &draw) - rise(&beside, &draw));
        gains.max_by(f64::total_cmp)
    }

    /// Whether it may be `other`: one that the catalogue says it can be taken for, or one that takes some of the same out of the
    /// residual of `present`, beside a bias. Two that take out what is different may be as good as one another, but may both be
    /// there.
    pub(super) fn may_be(&self, other: &Refit, present: &Present) -> bool {
        let ids = [self, other].map(|refit| refit.candidate.term.effect.card().id);
        if are_aliases(ids[0], ids[1]) {
            return true;
        }
        let out = |refit: &Refit| -> Vec<Vec<f64>> {
            let pairs = present.study.evaluation.residual.iter().zip(&refit.study.evaluation.residual);
            let t = present.study.bench.problem.times();
            pairs.map(|(a, b)| untrended(t, &a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())).collect()
        };
        let (own, other) = (out(self), out(other));
        let cross = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().zip(b).map(|(a, b)| dot(a, b)).sum::<f64>();
        cross(&own, &other).powi(2) > SHARED * cross(&own, &own) * cross(&other, &other)
    }

    fn is_as_likely_as(&self, other: &Refit) -> bool {
        let gains: Vec<f64> = self.gains.iter().zip(&other.gains).map(|(a, b)| a - b).collect();
        let (difference, error) = total(&gains);
        let inflation = self.inflation.max(other.inflation);
        let ids = [self, other].map(|refit| refit.candidate.term.effect.card().id);
        let least = if are_aliases(ids[0], ids[1]) { WITHIN_FORM } else { FOUND_TO.0 };
        // Twenty blocks tell that error roughly. Of two models that are nearly right it is known: what two differ by that lie d
        // standard deviations of the noise apart, ½d², varies by d. (What shows once, a wander may make in one block.)
        let nearly = self.excess.max(other.excess) < ROUGH && !ids.into_iter().any(is_slow);
        let of_noise = (2.0 * (self.rise - other.rise).abs() / inflation).sqrt();
        let error = if nearly { error.min(of_noise) } else { error };
        gains.len() == BLOCKS && difference.abs() < inflation * least.max(2.0 * error)
    }

    fn errs_as_much_as(&self, other: &Refit) -> bool {
        let (mean, spread) = self.against(other);
        mean.abs() < FOUND_TO.1.max(2.0 * spread)
    }

    /// Whether two of which only one leaves samples out leave about the same error on those that they keep: a gain on fewer
    /// samples says nothing of the others.
    fn leaves_as_much_as(&self, other: &Refit) -> bool {
        let (less, more) = (self.kept.min(other.kept), self.kept.max(other.kept));
        self.study.leaves_out() == other.study.leaves_out() || more < ROUGH || more < ROUGH * less
    }

    /// Whether it does as well as `other`, better or alike, by either measure.
    fn equals(&self, other: &Refit) -> bool {
        self.leaves_as_much_as(other)
            && (self.excess <= other.excess || self.errs_as_much_as(other))
            && (self.held_out.0 >= other.held_out.0 || self.is_as_likely_as(other))
    }

    /// Whether what `other` gains beyond it is a small share of what both gain.
    fn does_nearly_as_well(&self, other: &Refit) -> bool {
        self.excess < (1.0 + CLOSE) * other.excess && self.held_out.0 > (1.0 - CLOSE) * other.held_out.0
    }

    /// Whether it belongs in the place of the effect, of this many parameters, that `present` has and it has not: by
    /// likelihood where both are nearly right, and never with more error.
    #[must_use]
    pub fn replaces(&self, present: &Present, freedom: usize) -> bool {
        let before = self.before(present);
        let nearly = self.excess.max(before) < ROUGH;
        let more = self.candidate.freedom.saturating_sub(freedom) as f64;
        let present = present.beside(self.candidate.term.effect, self.candidate.series);
        nearly
            && !self.at_bound()
            && self.excess <= (1.0 + CLOSE) * before
            && self.gls.log_likelihood > present.gls.log_likelihood + PARAMETER * (1.0 + more)
    }

    /// Whether `other`, which may stand in its place, says as much with fewer parameters, and needs no free shape for a
    /// measured channel.
    #[must_use]
    pub fn is_said_plainer_by(&self, other: &Refit) -> bool {
        other.candidate.freedom < self.candidate.freedom
            && (other.goes_with_what_is_measured() || !self.goes_with_what_is_measured())
            && other.significant()
            && (self.alike(other) || self.hardly_beats(other))
    }

    fn goes_with_what_is_measured(&self) -> bool {
        !self.candidate.term.effect.card().needs.is_empty()
    }

    /// Rise of ln L less what its parameters are worth, to choose among some that are all good enough.
    #[must_use]
    pub fn worth(&self) -> f64 {
        self.rise - PARAMETER * self.candidate.freedom as f64
    }

    /// Whether, both being nearly right, its likelihood is not worth a parameter more than that of `other`.
    fn hardly_beats(&self, other: &Refit) -> bool {
        self.excess.max(other.excess) < ROUGH
            && other.excess < (1.0 + SHARE) * self.excess
            && self.rise - other.rise < PARAMETER
    }

    /// ln(J_other/J_self) over the blocks: mean and standard error.
    #[must_use]
    pub fn against(&self, other: &Refit) -> (f64, f64) {
        let logs: Vec<f64> =
            self.falls.iter().zip(&other.falls).filter_map(|(a, b)| Some(a.as_ref()? - b.as_ref()?)).collect();
        mean(&logs)
    }
}

/// Least squared correlation of what two effects take out that may be one another.
const SHARED: f64 = 0.1;
/// What an optimum's ln L and ln J are found to: two shapes of one motion may differ by less, and always to the same side.
const FOUND_TO: (f64, f64) = (0.25, 1e-3);
/// What ln L of two effects that may be taken for one another may differ by and say nothing: how either is undone between two
/// samples makes as much of the noise.
const WITHIN_FORM: f64 = 2.0;
/// J above which the noise is not all there is: likelihoods then trust a wrong model, and the held-out error decides.
pub(super) const ROUGH: f64 = 1.5;
/// Rise of ln L that one more parameter is worth (half the logarithm of some thousand readings).
const PARAMETER: f64 = 4.0;
/// Held-out errors that differ by less than this share count as equal.
const CLOSE: f64 = 0.03;
