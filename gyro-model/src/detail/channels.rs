//! What the error may depend on: the columns behind the regime panels.

use crate::{Axis, Record, effects::derivative};

/// Unit of a free column: its file does not say.
pub(super) const FREE: &str = "";

/// One column, of the length of the log.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name as in `fails_where`; of a free column, its own.
    pub regressor: String,
    /// SI unit; empty for a free column.
    pub unit: &'static str,
    /// Values; `NaN` where there is none.
    pub values: Vec<f64>,
}

/// The channels of this log that change at all. `rates` are the compensated rates of the three axes (empty where an
/// axis has none), `angle` the reference angle of this axis, unwrapped, rad.
#[must_use]
pub fn channels(record: &Record, axis: Axis, rates: [&[f64]; 3], angle: &[f64]) -> Vec<Channel> {
    let rows = &record.rows;
    let t: Vec<f64> = rows.iter().map(|r| r.t_ns as f64 * 1e-9).collect();
    let rate = rates[axis.index()];
    let mut all = vec![
        Channel { regressor: "time".into(), unit: "s", values: t.clone() },
        Channel { regressor: "rate".into(), unit: "rad/s", values: rate.to_vec() },
        Channel { regressor: "direction".into(), unit: "1", values: direction(rate) },
        Channel { regressor: "rate-change".into(), unit: "rad/s²", values: rate_change(&t, rate) },
        Channel { regressor: "angle".into(), unit: "rad", values: turn(angle) },
        Channel { regressor: "temperature".into(), unit: "°C", values: rows.iter().map(|r| r.temperature).collect() },
        Channel { regressor: "supply".into(), unit: "V", values: rows.iter().map(|r| r.supply).collect() },
    ];
    for other in Axis::ALL {
        let i = other.index();
        if other != axis && !rates[i].is_empty() {
            all.push(Channel { regressor: format!("rate-{other}"), unit: "rad/s", values: rates[i].to_vec() });
        }
        all.push(Channel {
            regressor: format!("acceleration-{other}"),
            unit: "m/s²",
            values: rows.iter().map(|r| r.accel[i]).collect(),
        });
    }
    for (k, name) in record.free_names.iter().enumerate() {
        let values = held(rows.iter().map(|r| r.free[k]));
        // What only rises or falls, as a counter does, says no more than the time.
        let is_clock =
            |after: fn(&f64, &f64) -> bool| values.iter().filter(|v| v.is_finite()).is_sorted_by(|a, b| after(b, a));
        if !is_clock(f64::ge) && !is_clock(f64::le) {
            all.push(Channel { regressor: name.clone(), unit: FREE, values });
        }
    }
    all.retain(|c| c.values.len() == rows.len() && changes(&c.values));
    all
}

/// Between its values, the last one.
fn held(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let keep = |last: &mut f64, value: f64| {
        *last = if value.is_finite() { value } else { *last };
        Some(*last)
    };
    values.scan(f64::NAN, keep).collect()
}

/// +1, −1, or 0 where the rate is below 3 % of its RMS.
fn direction(rate: &[f64]) -> Vec<f64> {
    let power: Vec<f64> = rate.iter().map(|w| w * w).collect();
    let still = 0.03 * super::mean(&power).sqrt();
    rate.iter()
        .map(|&w| match w {
            _ if w.is_nan() => f64::NAN,
            _ if w > still => 1.0,
            _ if w < -still => -1.0,
            _ => 0.0,
        })
        .collect()
}

/// dω/dt, averaged over about a fiftieth of a second so that it shows motion and not noise.
fn rate_change(t: &[f64], rate: &[f64]) -> Vec<f64> {
    if rate.len() != t.len() || t.len() < 8 {
        return Vec::new();
    }
    let raw = derivative(t, rate);
    let dt = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
    let half = ((0.02 / dt).round() as usize).max(1);
    (0..raw.len()).map(|k| super::mean(&raw[k.saturating_sub(half)..(k + half + 1).min(raw.len())])).collect()
}

/// Within one turn where the shaft turns more than once, as it is otherwise.
fn turn(angle: &[f64]) -> Vec<f64> {
    let (low, high) = extent(angle);
    if high - low <= std::f64::consts::TAU * 1.02 {
        return angle.to_vec();
    }
    angle.iter().map(|a| a.rem_euclid(std::f64::consts::TAU)).collect()
}

fn changes(values: &[f64]) -> bool {
    let (low, high) = extent(values);
    high - low > 1e-9 * high.abs().max(low.abs()).max(1e-9)
}

/// Smallest and largest finite value.
pub(super) fn extent(values: &[f64]) -> (f64, f64) {
    values.iter().filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| (a.min(v), b.max(v)))
}
