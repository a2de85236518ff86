//! Model and measurement over time, averaged so that a long log fits a screen.

use super::{Input, Referenced, Trace, short, some};

/// As many points as a wide screen can show with room to zoom.
const POINTS: f64 = 3000.0;

/// Averages over spans of a three-thousandth of the log, or over four samples of the reference where that is longer.
pub(super) fn trace(input: &Input, referenced: &Referenced) -> Trace {
    let span = (referenced.duration() / POINTS).max(4.0 * referenced.dt);
    let angle = integral(input);
    let mut trace = Trace::default();
    let mut last_end = None;
    for (from, to) in referenced.windows(span) {
        let (a, b) = (referenced.t[from], referenced.t[to]);
        if let Some(end) = last_end.filter(|end| a - end > span) {
            push(&mut trace, 0.5 * (end + a), f64::NAN, f64::NAN, f64::NAN);
        }
        let model = (angle[referenced.row[to]] - angle[referenced.row[from]]) / (b - a);
        let error = 0.5 * (referenced.error[from] + referenced.error[to]);
        push(&mut trace, 0.5 * (a + b), model, referenced.rate_error((from, to)), error);
        last_end = Some(b);
    }
    trace
}

fn push(trace: &mut Trace, t: f64, model: f64, residual: f64, angle_error: f64) {
    trace.t.push((t * 1e4).round() * 1e-4);
    trace.model.push(some(model));
    trace.measured.push(some(model - residual));
    trace.residual.push(some(residual));
    trace.angle_error.push(if angle_error.is_finite() { Some(short(angle_error)) } else { None });
}

/// ∫ω̂ dt by trapezoids, held over missing values.
fn integral(input: &Input) -> Vec<f64> {
    let mut angle = 0.0;
    let mut last: Option<(f64, f64)> = None;
    input
        .t
        .iter()
        .zip(input.rate)
        .map(|(&t, &w)| {
            if w.is_finite() {
                if let Some((t0, w0)) = last {
                    angle += 0.5 * (w + w0) * (t - t0);
                }
                last = Some((t, w));
            }
            angle
        })
        .collect()
}
