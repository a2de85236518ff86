//! What the judging thread does: the diagnosis of the recent data, as a message and as JSON.

use super::{store::View, thin::thinned};
use gyro_model::{
    Model,
    detail::Trace,
    diagnose::{self, diagnose},
    diagnosis::{AxisDiagnosis, Diagnosis},
    fit::FitError,
};
use ipc_types::{
    Text,
    diagnosis::{self as message, SUSPECTS, TAUS},
    topic::REPORT_BYTES,
};

/// Rows of one diagnosis; longer stretches are thinned.
pub const ROWS: usize = 12_000;

/// What to judge.
#[derive(Clone, Debug)]
pub struct Job {
    /// The model in use.
    pub model: Model,
    /// The data's name in the report.
    pub name: String,
    /// When the job was given, ns.
    pub took_ns: u64,
}

/// What came of it.
#[derive(Debug)]
pub struct Judgement {
    /// Without run, number and last stamp.
    pub message: ipc_types::Diagnosis,
    /// The whole as JSON.
    pub report: Vec<u8>,
}

/// Does a job.
///
/// # Errors
/// Where the data do not allow it yet.
pub fn judge(view: &View, job: &Job) -> Result<Judgement, FitError> {
    let record = thinned(&view.whole(), ROWS);
    let axes = diagnose(&record, &job.model, &record.fitted_axes(), &diagnose::Options::default())?;
    let span = |row: Option<&gyro_model::Row>| row.map_or(0, |row| row.t_ns);
    let mut message = ipc_types::Diagnosis {
        epoch: job.model.epoch,
        from_ns: span(record.rows.first()),
        to_ns: span(record.rows.last()),
        compensator_took_ns: job.took_ns,
        ..ipc_types::Diagnosis::default()
    };
    for axis in &axes {
        message.axes[axis.axis.index()] = of_axis(axis);
    }
    let mut whole = Diagnosis { schema: "truerate.diagnosis/1".to_owned(), log: job.name.clone(), axes };
    let mut report = serde_json::to_vec(&whole).unwrap_or_default();
    if report.len() > REPORT_BYTES {
        // The overlay over time is most of it, and the watchers see the motion itself.
        for detail in whole.axes.iter_mut().filter_map(|a| a.detail.as_mut()) {
            detail.trace = Trace::default();
        }
        report = serde_json::to_vec(&whole).unwrap_or_default();
    }
    Ok(Judgement { message, report })
}

fn of_axis(axis: &AxisDiagnosis) -> message::AxisDiagnosis {
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let mut out = message::AxisDiagnosis {
        present: 1,
        within_floor: u32::from(axis.within_floor == Some(true)),
        verdict: Text::new(&word(axis)),
        error_over_floor: number(axis.error_over_floor),
        ..message::AxisDiagnosis::default()
    };
    // The longest averaging times say most; the shortest go where there is no room.
    let first = axis.error_curve.len().saturating_sub(TAUS);
    for (slot, point) in out.curve.iter_mut().zip(&axis.error_curve[first..]) {
        *slot = message::ErrorPoint {
            tau: point.tau_s,
            error: number(point.error),
            floor: number(point.floor),
            floor_99: number(point.floor_99),
        };
    }
    for (slot, suspect) in out.suspects.iter_mut().zip(axis.suspects.iter().take(SUSPECTS)) {
        *slot = message::Suspect {
            effect: Text::new(&suspect.effect),
            aliases: Text::new(&suspect.aliases.join(" ")),
            error_fall: number(suspect.error_fall),
            p_value: number(suspect.p_value),
        };
    }
    out
}

/// The verdict as in the JSON.
fn word(axis: &AxisDiagnosis) -> String {
    serde_json::to_value(axis.verdict).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
}
