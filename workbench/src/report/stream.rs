//! The diagnosis of a stream, ready for a page that shows it while it runs.

use super::{Command, Context, view::Page};
use gyro_model::{
    diagnosis::{Diagnosis, Verdict},
    words::Voice,
};
use serde::Serialize;

/// A search that found nothing is not the last one.
const AGAIN: &str =
    "It is searched again and again: motion of another kind (faster, slower, warmer) may show the cause.";

/// As the page shows it: words, human units, cards.
#[must_use]
pub fn page(diagnosis: &Diagnosis) -> Page {
    let context = Context { voice: Voice::Stream, ..Context::new(Command::Diagnose, "live") };
    let mut page = Page::axis_by_axis(diagnosis, &context);
    for axis in &mut page.axes {
        axis.detail = None;
        if axis.verdict == Verdict::Unexplained {
            format!("{} {AGAIN}", axis.says).trim_start().clone_into(&mut axis.says);
        }
    }
    page
}

/// The judgement of one second.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ErrorAt {
    /// s of the source.
    pub t: f64,
    /// `x`, `y`, `z`.
    pub axis: &'static str,
    /// Largest error over floor.
    pub ratio: Option<f64>,
    /// Error at about 1 s, °/s.
    pub error: Option<f64>,
    /// Its floor, °/s.
    pub floor: Option<f64>,
}

/// The figures for the chart over time.
pub fn errors(diagnosis: &Diagnosis, t: f64) -> impl Iterator<Item = ErrorAt> + '_ {
    diagnosis.axes.iter().map(move |axis| {
        let near_1s = axis.error_curve.iter().min_by(|a, b| a.tau_s.ln().abs().total_cmp(&b.tau_s.ln().abs()));
        let degrees = |v: Option<f64>| v.filter(|v| v.is_finite()).map(f64::to_degrees);
        ErrorAt {
            t,
            axis: axis.axis.letter(),
            ratio: axis.error_over_floor.filter(|r| r.is_finite()),
            error: degrees(near_1s.and_then(|p| p.error)),
            floor: degrees(near_1s.and_then(|p| p.floor)),
        }
    })
}
