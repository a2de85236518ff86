//! Whether the sensor became another one while it ran: the error of a model that was good until then jumps.
//!
//! The stream is cut into windows of [`WINDOW`] seconds. Each is judged by itself, with the model in use and nothing
//! refitted. An effect that begins later raises the error of all windows from then on; a vehicle that only moves
//! otherwise raises it of one, or by less.

use super::store::View;
use gyro_model::{
    AxisModel, Model,
    diagnose::{self, compare},
    learning,
    thin::thinned,
};

/// Length of a window, s: some turns of a vehicle, and averaging times up to 1 s.
pub const WINDOW: f64 = 10.0;
/// Windows that an error has to be known from, before it can jump.
const KNOWN: usize = 3;
/// Mean of (E/F)² up to which nothing is missing: windows of noise alone gave 0.90 to 1.05 on a simulated vehicle.
const GOOD: f64 = 1.5;
/// A jump is that much of a good error²; …
const JUMP: f64 = 2.0;
/// … and that much where an effect is missing already, whose error motion alone changes from one window to the next.
const FURTHER: f64 = 6.0;
/// Windows in a row that have to show it.
const AGREE: usize = 2;
/// Rows of a window that are judged.
const ROWS: usize = 1_500;

/// The windows since the model, or the sensor, was another one.
#[derive(Clone, Debug, Default)]
pub struct Windows {
    /// Mean of (E/F)² of each window, and where it begins, ns.
    seen: Vec<(f64, i64)>,
    effects: [Option<Vec<&'static str>>; 3],
    data: u64,
}

impl Windows {
    /// Judges the newest window, once it is there; where the new data begin, ns, when the error has jumped. `data` grows by
    /// one whenever what was seen so far is forgotten.
    pub fn look(&mut self, view: &View, model: &Model, data: u64) -> Option<i64> {
        let effects = model.axes.each_ref().map(|axis| axis.as_ref().map(AxisModel::effect_ids));
        if (effects != self.effects) || data != self.data {
            *self = Self { effects, data, ..Self::default() };
        }
        let window = view.last(WINDOW);
        let (first, last) = (window.rows.first()?.t_ns, window.rows.last()?.t_ns);
        let is_whole = (last - first) as f64 * 1e-9 > 0.95 * WINDOW;
        let is_new = self.seen.last().is_none_or(|(_, from)| (first - from) as f64 * 1e-9 >= WINDOW);
        if !is_whole || !is_new {
            return None;
        }
        let window = thinned(&window, ROWS);
        let judged = compare(&window, model, &window.fitted_axes(), &diagnose::Options::default()).ok()?;
        let excess = learning::excess(&judged);
        tracing::debug!(excess, from_s = first as f64 * 1e-9, "window");
        self.take(excess, first)
    }

    /// The next window's error² over its floor's, and where it begins.
    fn take(&mut self, excess: f64, from_ns: i64) -> Option<i64> {
        if !excess.is_finite() {
            return None;
        }
        self.seen.push((excess, from_ns));
        let (before, newest) = self.seen.split_at_checked(self.seen.len().checked_sub(AGREE)?)?;
        if before.len() < KNOWN {
            return None;
        }
        let mut known: Vec<f64> = before.iter().map(|(excess, _)| *excess).collect();
        known.sort_by(f64::total_cmp);
        let typical = known[known.len() / 2].max(1.0);
        let jump = typical * if typical < GOOD { JUMP } else { FURTHER };
        // The first of them may have begun before the effect did.
        newest.iter().all(|(excess, _)| *excess > jump).then_some(from_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::Windows;

    fn jumps_at(errors: &[f64]) -> Option<i64> {
        let mut windows = Windows::default();
        errors.iter().zip(0..).find_map(|(error, k)| windows.take(*error, k))
    }

    #[test]
    fn an_error_that_rises_and_stays_is_a_jump_and_the_new_data_begin_after_its_first_window() {
        assert_eq!(jumps_at(&[1.0, 1.2, 0.9, 1.1, 1.8, 40.0, 50.0]), Some(6));
        assert_eq!(jumps_at(&[1.0, 0.8, 1.1, 5.0, 2.5]), Some(4));
        // An effect is missing from the start, and a larger one joins it.
        assert_eq!(jumps_at(&[30.0, 60.0, 20.0, 500.0, 400.0]), Some(4));
    }

    #[test]
    fn one_bad_window_a_slow_rise_and_errors_that_are_not_known_yet_are_none() {
        assert_eq!(jumps_at(&[1.0, 1.2, 0.9, 90.0, 1.0, 1.1, 80.0, 1.0]), None);
        assert_eq!(jumps_at(&[1.0, 1.3, 1.6, 1.9, 2.2, 2.8, 3.5, 4.5]), None);
        assert_eq!(jumps_at(&[1.0, 1.0, 50.0, 50.0]), None);
        assert_eq!(jumps_at(&[1.0, 1.0, 1.0, f64::NAN, 50.0, f64::INFINITY]), None);
        assert_eq!(jumps_at(&[0.1, 0.1, 0.1, 0.9, 0.9, 1.9, 1.9]), None);
        // Of an effect that was missing all along, on a vehicle that turns now more, now less.
        assert_eq!(jumps_at(&[30.0, 200.0, 20.0, 90.0, 300.0, 250.0]), None);
    }
}
