//! Which suspect comes first, and what this log cannot tell apart: the numbers of [`Contrast`], and their order.

use super::{
    challenger::{BLOCKS_APART, Challenger, Incumbent},
    contrast::{ALIKE, Contrast, EQUALS, HARDLY_BEATS, MAY_LEAD, NEARLY_EQUALS, PLAINER, REPLACES, SIMPLER},
    decision::passes,
};
use crate::{
    Axis,
    effects::{Stage, Trait, are_aliases},
    evidence::{
        draws::Draws,
        gain::untrended,
        noise::{self, BLOCKS},
    },
    nls::{self, dot},
    scan::DRAWS,
    statistics::Estimate,
    thresholds as limit,
};
use std::{f64::consts::SQRT_2, ops::Range};

/// By the held-out error where that tells them apart, else by the held-out likelihood, which tells more finely; on the same rows.
pub(super) fn rank(challengers: &mut Vec<Challenger>) {
    let mut left = std::mem::take(challengers);
    while let Some(lowest) = left.iter().min_by(|a, b| a.excess.total_cmp(&b.excess)) {
        let best = (0..left.len())
            .filter(|&k| passes(MAY_LEAD, &left[k].beside(lowest)))
            .max_by(|&a, &b| left[a].held_out.value.total_cmp(&left[b].held_out.value))
            .unwrap_or(0);
        let best = on_same_rows(&left, best).unwrap_or(best);
        challengers.push(left.remove(best));
    }
}

/// The likeliest of those that judge all rows, in the place of a suspect that leaves some out, where it is the likelier one on the rows
/// that this one keeps, too: of few rows an error is small by chance.
fn on_same_rows(left: &[Challenger], best: usize) -> Option<usize> {
    let own = &left[best];
    let is_likelier = |other: &Challenger| {
        !other.study.leaves_out() && other.significant() && other.held_out.value > own.held_out.value
    };
    let others = (0..left.len()).filter(|&k| own.study.leaves_out() && is_likelier(&left[k]));
    let likeliest = others.max_by(|&a, &b| left[a].held_out.value.total_cmp(&left[b].held_out.value))?;
    let (excess, log_likelihood) = left[likeliest].on_rows_of(own);
    (log_likelihood > own.gls.log_likelihood && excess < limit::KEPT_ALIKE.value * own.kept).then_some(likeliest)
}

/// Drops a resonance where a tone that it takes out does as well: what the motion sets ringing does not ring in one phase
/// throughout the log, while the inverse of a resonance is a notch, which takes out any line.
pub(super) fn drop_driven(challengers: &mut Vec<Challenger>) {
    let is = |r: &Challenger, wanted: Trait| r.candidate.term.effect.is(wanted);
    let frequency = |r: &Challenger| {
        let cards = r.candidate.term.effect.parameters(Axis::X);
        cards.iter().position(|card| card.unit == "Hz").map_or(f64::NAN, |k| r.candidate.term.values[k])
    };
    let (mut resonances, others): (Vec<Challenger>, Vec<Challenger>) =
        std::mem::take(challengers).into_iter().partition(|r| is(r, Trait::Resonance));
    let drives = |tone: &Challenger, r: &Challenger| {
        is(tone, Trait::Line)
            && tone.candidate.series == r.candidate.series
            && TAKEN_OUT.contains(&(frequency(tone) / frequency(r)))
            && {
                let two = tone.beside(r);
                passes(EQUALS, &two) || passes(NEARLY_EQUALS, &two)
            }
    };
    resonances.retain(|r| !others.iter().any(|tone| drives(tone, r)));
    *challengers = others;
    challengers.append(&mut resonances);
}

/// Drops a clock that was set where another error of the times, which is there throughout, is simpler, takes the same out of the residual
/// and does as well: one that was set before the sensor moved is a delay.
pub(super) fn drop_seen_from_one_side(challengers: &mut Vec<Challenger>, incumbent: &Incumbent) {
    let is_of_times = |r: &Challenger| r.candidate.term.effect.stage() == Stage::Timing;
    let begins = |r: &Challenger| is_of_times(r) && r.candidate.term.effect.is(Trait::Onset);
    let stands_for = |plain: &Challenger, r: &Challenger| {
        is_of_times(plain)
            && !begins(plain)
            && plain.candidate.freedom < r.candidate.freedom
            && plain.in_common(r, incumbent) > limit::THE_SAME.value
            && r.alike(plain)
    };
    let dropped: Vec<usize> = (0..challengers.len())
        .filter(|&k| begins(&challengers[k]) && challengers.iter().any(|plain| stands_for(plain, &challengers[k])))
        .collect();
    dropped.into_iter().rev().for_each(|k| drop(challengers.remove(k)));
}

/// Whether a suspect does as well as the smoothing of a reference whose readings are whole counts, which it may be taken for: such a
/// reference is not smoothed, unless it counts afterwards.
fn stands_for_smoothed_counts(other: &Challenger, smoothed: &Challenger) -> bool {
    let id = |r: &Challenger| r.candidate.term.effect.card().id;
    let series = &smoothed.study.bench.problem.series[smoothed.candidate.series];
    smoothed.candidate.term.effect.stage() == Stage::Shown
        && series.encoder.step > 0.0
        && other.candidate.series == smoothed.candidate.series
        && are_aliases(id(other), id(smoothed))
        && (other.excess < limit::SCATTERS.value * smoothed.excess || smoothed.alike(other))
}

/// Takes out the smoothing of whole counts where another suspect may stand for it.
pub(super) fn take_smoothed_counts<'a>(challengers: &mut Vec<Challenger<'a>>) -> Vec<Challenger<'a>> {
    let stands = |k: &usize| challengers.iter().any(|other| stands_for_smoothed_counts(other, &challengers[*k]));
    let taken: Vec<usize> = (0..challengers.len()).filter(stands).collect();
    taken.into_iter().rev().map(|k| challengers.remove(k)).collect()
}

/// Frequencies, over its own, of lines that the inverse of a resonance makes much smaller or turns over: it multiplies them by
/// 1 − (f/f₀)², but for the damping.
const TAKEN_OUT: Range<f64> = 0.5..SQRT_2;

/// Puts before the best what cannot be told from it and is plainer: fewer parameters, or a measured channel instead of
/// a free shape, for one more at most.
pub(super) fn prefer_plainer(challengers: &mut [Challenger], incumbent: &Incumbent) {
    let Some(best) = challengers.first() else { return };
    let plainer = (1..challengers.len()).find(|&k| {
        let r = &challengers[k];
        let two = best.beside(r);
        r.candidate.series == best.candidate.series
            && passes(SIMPLER, &two)
            && (r.significant() || r.passes(incumbent))
            && (best.alike(r) || passes(HARDLY_BEATS, &two))
    });
    if let Some(k) = plainer {
        challengers[..=k].rotate_right(1);
    }
}

/// Suspects that this log cannot tell from `suspects[k]`, that do not contain it as their simpler effect, and that noise alone does not
/// explain, `incumbent` would let in, or the catalogue has for aliases and which leave no more error: at most three, best first.
#[must_use]
pub(super) fn aliases(suspects: &[Challenger], k: usize, incumbent: Option<&Incumbent>) -> Vec<String> {
    let own = &suspects[k];
    if own.candidate.term.effect.stage() == Stage::Reading {
        return Vec::new();
    }
    let id = |refit: &Challenger| refit.candidate.term.effect.card().id;
    let is_as_good = |r: &Challenger| are_aliases(id(own), id(r)) && r.excess <= own.excess && !r.at_bound();
    let contains_own = |r: &Challenger| r.candidate.term.effect.card().simpler.contains(&id(own));
    let is_real =
        |r: &Challenger| r.significant() || is_as_good(r) || incumbent.is_some_and(|incumbent| r.passes(incumbent));
    suspects
        .iter()
        .enumerate()
        .filter(|(i, r)| *i != k && r.candidate.series == own.candidate.series && !contains_own(r) && is_real(r))
        .filter(|(_, r)| {
            own.alike(r) || r.excess < limit::SCATTERS.value * own.excess && stands_for_smoothed_counts(own, r)
        })
        .filter(|(_, r)| incumbent.is_none_or(|incumbent| own.may_be(r, incumbent)))
        .map(|(_, r)| id(r).to_owned())
        .take(ALIASES)
        .collect()
}

/// Aliases that are told of one effect.
pub(super) const ALIASES: usize = 3;

impl Challenger<'_> {
    /// Its numbers beside those of `other`.
    pub(super) fn beside(&self, other: &Challenger) -> Contrast {
        let two = [self, other];
        let of = |value: fn(&Challenger) -> f64| two.map(value);
        let gains: Vec<f64> = self.gains.iter().zip(&other.gains).map(|(a, b)| a - b).collect();
        let inflation = self.inflation.max(other.inflation);
        let of_blocks = Estimate::sum(&gains);
        // Where a block says nothing of one of them, the blocks do not compare them.
        let value = if gains.len() == BLOCKS { of_blocks.value / inflation } else { f64::INFINITY };
        let ids = two.map(|refit| refit.candidate.term.effect.card().id);
        Contrast {
            after: of(|r| r.excess),
            kept: of(|r| r.kept),
            gain: of(|r| r.rise),
            held_out: of(|r| r.held_out.value),
            freedom: of(|r| r.candidate.freedom as f64),
            leave_other_rows: self.study.leaves_out() != other.study.leaves_out(),
            is_slow: two.iter().any(|r| r.candidate.term.effect.is(Trait::Slow)),
            are_aliases: are_aliases(ids[0], ids[1]),
            is_one_sine: self.study.bench.problem.series[self.candidate.series].one_line.is_some(),
            measured: two.map(|r| !r.candidate.term.effect.card().needs.is_empty()),
            gain_apart: Estimate { value, ..of_blocks },
            error_apart: self.against(other),
            of_steps: 0.0,
            inflation,
        }
    }

    /// Whether this log cannot tell it from `other`.
    #[must_use]
    pub(crate) fn alike(&self, other: &Challenger) -> bool {
        let two = self.beside(other);
        if passes(ALIKE, &two) {
            return true;
        }
        // What steps make costs draws, or a model evaluated again: it is asked only where it may decide.
        passes(ALIKE, &Contrast { of_steps: f64::INFINITY, ..two }) && {
            let (better, worse) = if self.rise > other.rise { (self, other) } else { (other, self) };
            let of_encoder = better.raises_on_steps_beside(worse).unwrap_or(0.0);
            let of_temperature = worse.study.of_temperature_steps(&worse.gls.noise);
            passes(ALIKE, &Contrast { of_steps: of_encoder + of_temperature, ..two })
        }
    }

    /// What ln L rises by at most where this effect joins `other` on draws of noise alone; `None` where the motion does not
    /// repeat itself.
    fn raises_on_steps_beside(&self, other: &Challenger) -> Option<f64> {
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
    /// residual of `incumbent`, beside a bias. Two that take out what is different may be as good as one another, but may both be
    /// there.
    pub(super) fn may_be(&self, other: &Challenger, incumbent: &Incumbent) -> bool {
        let ids = [self, other].map(|refit| refit.candidate.term.effect.card().id);
        are_aliases(ids[0], ids[1]) || self.in_common(other, incumbent) > limit::SHARED.value
    }

    /// Squared correlation of what the two take out of the residual of `incumbent`, beside a bias.
    fn in_common(&self, other: &Challenger, incumbent: &Incumbent) -> f64 {
        let out = |refit: &Challenger| -> Vec<Vec<f64>> {
            let pairs = incumbent.study.evaluation.residual.iter().zip(&refit.study.evaluation.residual);
            let t = incumbent.study.bench.problem.times();
            pairs.map(|(a, b)| untrended(t, &a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())).collect()
        };
        let (own, other) = (out(self), out(other));
        let cross = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().zip(b).map(|(a, b)| dot(a, b)).sum::<f64>();
        cross(&own, &other).powi(2) / (cross(&own, &own) * cross(&other, &other))
    }

    /// Whether it belongs in the place of the effect, of this many parameters, that `incumbent` has and it has not: by
    /// likelihood where both are nearly right, and never with more error.
    #[must_use]
    pub(crate) fn replaces(&self, incumbent: &Incumbent, freedom: usize) -> bool {
        let before = self.before(incumbent);
        let model = incumbent.beside(self.candidate.term.effect, self.candidate.series);
        let two = Contrast {
            after: [self.excess, before],
            gain: [self.gls.log_likelihood, model.gls.log_likelihood],
            freedom: [self.candidate.freedom as f64, freedom as f64],
            ..self.beside(self)
        };
        !self.at_bound() && passes(REPLACES, &two)
    }

    /// Whether `other`, which may stand in its place, says as much with fewer parameters, and needs no free shape for a
    /// measured channel.
    #[must_use]
    pub(crate) fn is_said_plainer_by(&self, other: &Challenger) -> bool {
        let two = self.beside(other);
        passes(PLAINER, &two) && other.significant() && (self.alike(other) || passes(HARDLY_BEATS, &two))
    }

    /// Rise of ln L less what its parameters are worth, to choose among some that are all good enough.
    #[must_use]
    pub(crate) fn worth(&self) -> f64 {
        self.rise - limit::PARAMETER.value * self.candidate.freedom as f64
    }

    /// ln(J_other/J_self) over the blocks.
    #[must_use]
    pub(crate) fn against(&self, other: &Challenger) -> Estimate {
        let logs: Vec<f64> =
            self.falls.iter().zip(&other.falls).filter_map(|(a, b)| Some(a.as_ref()? - b.as_ref()?)).collect();
        Estimate::mean(&logs, BLOCKS_APART)
    }
}
