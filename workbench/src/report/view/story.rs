//! Several axes, one story: what they share said once, and a row for each thing that an axis has of its own.

use super::{AxisView, axis};
use gyro_model::{
    Axis,
    diagnosis::{ErrorPoint, ParameterValue, Verdict},
    headline::{Beside, Fall, Named, Shared, Standing, Together},
    units,
    words::{Voice, labels},
};
use serde::Serialize;

/// What all axes come to.
#[derive(Clone, Debug, Serialize)]
pub struct Story {
    /// What several axes share, a sentence each, with what to do about it.
    pub shared: Vec<Shared>,
    /// Heads of the table's columns.
    pub head: [&'static str; 4],
    /// The table.
    pub rows: Vec<Row>,
    /// Faults of the data that are every axis'.
    pub faults: Vec<String>,
}

/// One row: what a sensor, or one axis of it, has.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Row {
    /// `x`, or `x y z` of what they share; empty below another row of the axis.
    pub axis: String,
    /// What stands under the other heads.
    pub cells: [String; 3],
    /// The verdict's colour; empty where the row is no axis' first.
    pub tone: &'static str,
    /// Whether the last cell says what was won.
    pub won: bool,
}

/// What it is, its size, and what is left of the axis' error.
const HEAD: [&str; 4] = ["axis", "what", "size", "left"];
/// Of two models.
const HEAD_OF_TWO: [&str; 4] = ["axis", "this model is", "error", "floor"];

impl Story {
    /// Of the axes in their order; `None` where there is one alone. What all of them have is taken out of each. `is_won` where the
    /// errors have fallen so, and not only would.
    pub(super) fn of(
        together: &Together,
        named: &[Named],
        axes: &mut [AxisView],
        falls: &[Option<Fall>],
        is_won: bool,
    ) -> Option<Self> {
        if axes.len() < 2 {
            return None;
        }
        let mut rows: Vec<Row> = together.shared.iter().map(|shared| of_several(shared, together)).collect();
        for ((named, view), fall) in named.iter().zip(axes.iter()).zip(falls) {
            let told = together.told(named.axis);
            let own = named.effects.iter().filter(|id| !told.contains(id));
            let mut own: Vec<Row> = own.map(|id| row((*id).to_owned(), size(named, id))).collect();
            if own.is_empty() {
                own.push(row(without(view, !told.is_empty()), String::new()));
            }
            (own[0].axis, own[0].tone) = (view.axis.to_owned(), view.tone);
            own[0].cells[2] = fall.as_ref().map_or_else(String::new, left);
            own[0].won = is_won && fall.as_ref().is_some_and(|fall| fall.before.is_some());
            rows.append(&mut own);
        }
        let faults = faults_of_all(axes);
        Some(Self { shared: together.shared.clone(), head: HEAD, rows, faults })
    }

    /// Of two models, axis by axis; `None` where there is one axis alone.
    pub(super) fn of_two(together: &Together, besides: &[Option<Beside>], axes: &mut [AxisView]) -> Option<Self> {
        if axes.len() < 2 {
            return None;
        }
        let rows = axes.iter().zip(besides).map(|(view, beside)| of_beside(view.axis, beside.as_ref())).collect();
        let faults = faults_of_all(axes);
        Some(Self { shared: together.shared.clone(), head: HEAD_OF_TWO, rows, faults })
    }
}

/// Takes out of each axis the faults that all of them have.
fn faults_of_all(axes: &mut [AxisView]) -> Vec<String> {
    let is_everywhere = |fault: &&String| axes.iter().all(|axis| axis.data_faults.contains(fault));
    let faults: Vec<String> = axes[0].data_faults.iter().filter(is_everywhere).cloned().collect();
    for axis in axes {
        axis.data_faults.retain(|fault| !faults.contains(fault));
    }
    faults
}

fn row(what: String, size: String) -> Row {
    Row { cells: [what, size, String::new()], ..Row::default() }
}

/// `better`, `3.80 → 0.00386 °/s over 1 s, noise`, `0.00404 °/s`.
fn of_beside(axis: &str, beside: Option<&Beside>) -> Row {
    let (says, tone, cells) = beside.map_or(("–", "", Default::default()), |beside| {
        let (says, tone) = match beside.standing {
            Standing::Better => ("better", "good"),
            Standing::Worse => ("worse", "bad"),
            Standing::Same => ("no different", ""),
        };
        let rate = |value| units::rate(Some(value));
        let noise = if beside.is_noise { ", noise" } else { "" };
        let over = units::time(beside.tau_s);
        let error = format!("{} → {} °/s over {over}{noise}", rate(beside.other_error), rate(beside.error));
        (says, tone, (error, beside.floor.map_or_else(|| "–".to_owned(), |floor| format!("{} °/s", rate(floor)))))
    });
    Row { axis: axis.to_owned(), cells: [says.to_owned(), cells.0, cells.1], tone, won: false }
}

/// The row of what several axes share.
fn of_several(shared: &Shared, together: &Together) -> Row {
    let letters: Vec<&str> = shared.axes.iter().map(|axis| axis.letter()).collect();
    let rotation = together.rotation.as_ref().filter(|_| shared.effect == "cross-axis");
    let (what, size) = match rotation {
        Some(rotation) => {
            let angle = units::shown("rad", &[]);
            ("a turned sensor".to_owned(), units::uncertain(Some(rotation.angle), Some(rotation.std_error), &angle))
        }
        None => (shared.effect.clone(), size_of(shared.axes[0], &shared.effect, &shared.parameters)),
    };
    Row { axis: letters.join(" "), ..row(what, size) }
}

/// What stands in place of an effect on an axis that has none of its own.
fn without(view: &AxisView, shares: bool) -> String {
    match view.verdict {
        Verdict::Adequate | Verdict::MissingEffect if shares => "nothing else".to_owned(),
        Verdict::Adequate => labels::NOTHING.to_owned(),
        Verdict::CannotTell if shares => "cannot tell more".to_owned(),
        _ => view.brief.clone(),
    }
}

/// The size of an effect on one axis.
fn size(named: &Named, id: &str) -> String {
    let own: Vec<ParameterValue> = named.parameters.iter().copied().filter(|p| p.effect == id).cloned().collect();
    size_of(named.axis, id, &own)
}

/// Its first parameter that the log shows; with its name where there are more.
fn size_of(axis: Axis, id: &str, own: &[ParameterValue]) -> String {
    let views = axis::parameters(axis, own, false, Voice::Log);
    let own: Vec<_> = views.iter().filter(|view| view.effect == id).collect();
    let seen = own.iter().find(|view| view.is_seen);
    match (own.as_slice(), seen) {
        ([one], _) => one.shown.clone(),
        (_, Some(first)) => format!("{} = {}, …", first.name, first.shown),
        (_, None) => String::new(),
    }
}

/// `0.51 → 0.035 °/s over 1 s, noise`.
fn left(fall: &Fall) -> String {
    let number = |p: &ErrorPoint| units::rate(p.error);
    let before = fall.before.as_ref().map_or_else(String::new, |before| format!("{} → ", number(before)));
    let rest = match fall.after.error.zip(fall.after.floor).filter(|(_, floor)| *floor > 0.0) {
        _ if fall.is_noise => ", noise".to_owned(),
        Some((error, floor)) => format!(", {} × floor", units::ratio(error / floor)),
        None => String::new(),
    };
    format!("{before}{} °/s over {}{rest}", number(&fall.after), units::time(fall.after.tau_s))
}
