//! Effects hidden in a replayed log: the recorded rows are taken for the truth, and spoilt as the simulator would.

use super::{Hidden, HiddenError};
use crate::{
    Axis, Row,
    effects::{Memory, Signals, Stage},
};
use std::collections::VecDeque;

/// Readings that are kept, for those that come late.
const PAST: usize = 8192;

/// What spoils the rows of one axis.
#[derive(Debug)]
pub struct Injection {
    axis: Axis,
    effects: Vec<(Hidden, Memory)>,
    /// Time in s, and reading.
    past: VecDeque<(f64, f64)>,
    supply: f64,
    /// The last values of what may be read more seldom than the gyro.
    held: Row,
}

impl Injection {
    /// Nothing is spoilt yet.
    #[must_use]
    pub fn new(axis: Axis) -> Self {
        Self { axis, effects: Vec::new(), past: VecDeque::new(), supply: f64::NAN, held: Row::EMPTY }
    }

    /// Whether anything is spoilt.
    #[must_use]
    pub fn is_on(&self) -> bool {
        !self.effects.is_empty()
    }

    /// Switches an effect on, or gives it other parameters: `ID[:NAME=VALUE,…]`.
    ///
    /// # Errors
    /// An unknown effect or parameter.
    pub fn hide(&mut self, text: &str) -> Result<(), HiddenError> {
        self.add(Hidden::parse(text, self.axis)?);
        Ok(())
    }

    /// Switches an effect on, or gives it other parameters.
    pub fn add(&mut self, hidden: Hidden) {
        let id = hidden.effect.card().id;
        match self.effects.iter_mut().find(|(known, _)| known.effect.card().id == id) {
            Some((known, _)) => *known = hidden,
            None => self.effects.push((hidden, Memory::default())),
        }
    }

    /// The row as the spoilt sensor would have given it.
    #[must_use]
    pub fn spoil(&mut self, mut row: Row) -> Row {
        let i = self.axis.index();
        let (t, read) = (row.t_ns as f64 * 1e-9, row.gyro[i]);
        let before = self.past.back().copied();
        if read.is_finite() {
            self.past.push_back((t, read));
            if self.past.len() > PAST {
                self.past.pop_front();
            }
        }
        self.hold(&row);
        if self.supply.is_nan() {
            self.supply = row.supply;
        }
        if !self.is_on() {
            return row;
        }
        let known = |value: f64| if value.is_finite() { value } else { 0.0 };
        let dt = before.map_or(0.0, |(t0, _)| t - t0);
        let mut signals = Signals {
            t,
            dt,
            axis: i,
            rates: row.gyro.map(known),
            rate_dot: before.map_or(0.0, |(_, r0)| if dt > 0.0 { (known(read) - r0) / dt } else { 0.0 }),
            angle: known(row.ref_angle[i]),
            accel: self.held.accel.map(known),
            delta_temperature: known(self.held.temperature - 25.0),
            delta_supply: known(self.held.supply - self.supply),
            supply: known(self.held.supply),
            free: self.held.free.map(known),
            ..Signals::default()
        };
        if row.ref_angle[i].is_finite() {
            let of_reference = self.effects.iter_mut().filter(|(h, _)| h.effect.stage().is_of_reference());
            row.ref_angle[i] += of_reference.map(|(h, m)| h.effect.error(&h.values, &signals, m)).sum::<f64>();
        }
        if read.is_finite() {
            row.gyro[i] = self.reading(&mut signals, read);
        }
        row
    }

    /// Keeps the values of a row for those in which a channel that is read more seldom has none.
    fn hold(&mut self, row: &Row) {
        let keep = |held: &mut f64, value: f64| *held = if value.is_finite() { value } else { *held };
        let held = &mut self.held;
        held.accel.iter_mut().zip(row.accel).for_each(|(held, value)| keep(held, value));
        held.free.iter_mut().zip(row.free).for_each(|(held, value)| keep(held, value));
        keep(&mut held.temperature, row.temperature);
        keep(&mut held.supply, row.supply);
    }

    /// The stages of the gyro, in the simulator's order.
    fn reading(&mut self, signals: &mut Signals, read: f64) -> f64 {
        let (axis, dt) = (self.axis.index(), signals.dt);
        let timing = self.effects.iter().filter(|(h, _)| h.effect.stage() == Stage::Timing);
        let valid = timing.fold(signals.t, |t, (h, _)| h.effect.valid_time(&h.values, t));
        let mut rate = if valid == signals.t { read } else { self.at(valid) };
        signals.rates[axis] = rate;
        let is_mount = |effect: &Hidden| effect.effect.card().id == "mount-resonance";
        let respond = |effects: &mut [(Hidden, Memory)], rate: f64, mount: bool| {
            let responses = effects.iter_mut().filter(|(h, _)| h.effect.stage() == Stage::Response);
            let those = responses.filter(|(h, _)| is_mount(h) == mount);
            those.fold(rate, |rate, (h, m)| h.effect.respond(&h.values, rate, dt, m))
        };
        rate = respond(&mut self.effects, rate, true);
        signals.rates[axis] = rate;
        let felt = self.effects.iter_mut().filter(|(h, _)| h.effect.stage() == Stage::Felt);
        rate += felt.map(|(h, m)| h.effect.error(&h.values, signals, m)).sum::<f64>();
        rate = respond(&mut self.effects, rate, false);
        let of = |id: &'static str| self.effects.iter().filter(move |(h, _)| h.effect.card().id == id);
        rate -= of("bias").map(|(h, _)| h.values[0]).sum::<f64>();
        rate /= of("scale-factor").map(|(h, _)| h.values[0]).product::<f64>();
        let limits = self.effects.iter().filter(|(h, _)| h.effect.stage() == Stage::Reading);
        limits.fold(rate, |rate, (h, _)| h.effect.limit(&h.values, rate))
    }

    /// The recorded reading at an earlier time; the newest for a later one.
    fn at(&self, t: f64) -> f64 {
        let after = self.past.partition_point(|&(time, _)| time < t);
        match (after.checked_sub(1).and_then(|k| self.past.get(k)), self.past.get(after)) {
            (Some(&(t0, r0)), Some(&(t1, r1))) => r0 + (r1 - r0) * (t - t0) / (t1 - t0),
            (Some(&(_, r)), None) | (None, Some(&(_, r))) => r,
            (None, None) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(k: i64) -> Row {
        let mut row = Row { t_ns: k * 10_000_000, ..Row::EMPTY };
        row.gyro[2] = (0.05 * k as f64).sin();
        row.ref_angle[2] = 0.2;
        row
    }

    #[test]
    fn nothing_hidden_changes_nothing() {
        let mut injection = Injection::new(Axis::Z);
        assert_eq!(injection.spoil(row(5)).gyro[2], row(5).gyro[2]);
    }

    #[test]
    fn a_delay_gives_what_was_read_before() {
        let mut injection = Injection::new(Axis::Z);
        injection.hide("delay:d=0.02").unwrap();
        let spoilt: Vec<Row> = (0..50).map(|k| injection.spoil(row(k))).collect();
        for (before, now) in (0..48).zip(&spoilt[2..]) {
            assert!((now.gyro[2] - row(before).gyro[2]).abs() < 1e-9, "{before}");
        }
    }

    #[test]
    fn a_bias_and_a_scale_are_those_of_the_models_equation_in_whatever_order() {
        for order in [["scale-factor:alpha=2", "bias:delta=0.1"], ["bias:delta=0.1", "scale-factor:alpha=2"]] {
            let mut injection = Injection::new(Axis::Z);
            for text in order {
                injection.hide(text).unwrap();
            }
            let spoilt = injection.spoil(row(5)).gyro[2];
            assert!((2.0 * spoilt + 0.1 - row(5).gyro[2]).abs() < 1e-12, "{order:?}: {spoilt}");
        }
    }

    #[test]
    fn what_is_read_more_seldom_than_the_gyro_is_held() {
        let mut injection = Injection::new(Axis::Z);
        injection.hide("g-sensitivity:g_x=0.01,g_y=0,g_z=0").unwrap();
        for k in 0..40 {
            let accel = if k % 5 == 0 { [9.0, 0.0, 0.0] } else { [f64::NAN; 3] };
            let added = injection.spoil(Row { accel, ..row(k) }).gyro[2] - row(k).gyro[2];
            assert!((added - 0.09).abs() < 1e-12, "{k}: {added}");
        }
    }

    #[test]
    fn a_smoothed_reference_shows_less_of_a_turn_that_quickens() {
        let mut injection = Injection::new(Axis::Z);
        injection.hide("reference-smoothing:w=0.02").unwrap();
        for k in 1..60 {
            let (before, now) = (row(k - 1), row(k));
            let spoilt = injection.spoil(now);
            let slope = (now.gyro[2] - before.gyro[2]) / 0.01;
            let added = if k == 1 { 0.0 } else { 0.5 * 0.02 * 0.02 * slope };
            assert!((spoilt.ref_angle[2] - now.ref_angle[2] - added).abs() < 1e-12, "{k}");
            assert_eq!(spoilt.gyro[2].to_bits(), now.gyro[2].to_bits());
        }
    }

    #[test]
    fn every_effect_of_the_catalogue_can_be_hidden_and_keeps_rows_finite() {
        for effect in crate::effects::CATALOGUE {
            let mut injection = Injection::new(Axis::Z);
            injection.hide(effect.card().id).unwrap();
            for k in 0..200 {
                let spoilt = injection.spoil(row(k));
                assert!(spoilt.gyro[2].is_finite() && spoilt.ref_angle[2].is_finite(), "{}", effect.card().id);
            }
        }
    }
}
