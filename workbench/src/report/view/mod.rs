//! A result made ready to be read: human units, words, and what to run next. Text and HTML both lay this out.

mod axis;
mod explained;
mod parts;
mod sides;
mod story;

pub use axis::fault;
pub use parts::{
    AliasView, CardView, Curve, ExplainedView, LimitView, ParameterView, PartView, StepView, SuspectView, TestView,
};
pub use story::{Row, Story};

use super::{Against, Change, Context, Product, next};
use axis::{curve, falling, tone};
use gyro_model::{
    Axis,
    detail::{AxisDetail, Trace},
    diagnosis::{AxisResult, Diagnosis, ErrorPoint, Verdict},
    drift,
    headline::{self, Beside, Fall, Headline, Named, Together},
    words::{Voice, beyond, labels},
};
use serde::Serialize;

/// One result.
#[derive(Clone, Debug, Serialize)]
pub struct Page {
    /// What was done: `compare`, `diagnose`, `before and after`, `ladder`, …
    pub title: String,
    /// The log.
    pub log: String,
    /// What the log is, in a few words each.
    pub about: Vec<String>,
    /// What has to be known before anything else.
    pub warning: String,
    /// Several axes at once; `None` where there is one.
    pub story: Option<Story>,
    /// One entry an axis.
    pub axes: Vec<AxisView>,
    /// What to run next, best first.
    pub next: Vec<next::Next>,
    /// How to see its charts.
    #[serde(skip)]
    pub look: Option<next::Next>,
    /// Whether each test of a suspect is told with its numbers.
    #[serde(skip)]
    pub tests: bool,
    /// The new model, to be taken along.
    pub product: Option<Product>,
    /// Of the program.
    pub version: &'static str,
}

/// One axis.
#[derive(Clone, Debug, Serialize)]
pub struct AxisView {
    /// `x`, `y`, `z`.
    pub axis: &'static str,
    /// `missing-effect`, …
    pub verdict: Verdict,
    /// The answer with its number: `Your gyro is 10.05 ± 0.05 ms late. That makes …`.
    pub headline: String,
    /// What to do where it comes from; empty where nothing is to be done.
    pub at_source: String,
    /// `missing effect: delay`.
    pub label: String,
    /// The same in a cell of a table.
    #[serde(skip)]
    pub brief: String,
    /// `good`, `warn`, `bad`, `unknown`.
    pub tone: &'static str,
    /// In a sentence or two.
    pub says: String,
    /// Whether a search ends there: the recording is of no use for a verdict.
    #[serde(skip)]
    pub ends: bool,
    /// What the model has.
    pub effects: Vec<CardView>,
    /// Its parameters.
    pub parameters: Vec<ParameterView>,
    /// Its noise, in one sentence; empty where there is none.
    pub noise: String,
    /// The error curves: the first is where it started, the last where it ended; all in °/s.
    pub curves: Vec<Curve>,
    /// Which curve is the one judged.
    pub judged: usize,
    /// Whether its errors are told in large figures; not where two sensors stand side by side.
    pub figures: bool,
    /// Largest error/floor.
    pub error_over_floor: Option<f64>,
    /// Every error below the band's upper end.
    pub within_floor: Option<bool>,
    /// Where the floor's noise comes from.
    pub floor_source: String,
    /// By how much an angle is off after some time without a reference; empty where the log is too short to say it.
    pub drift: String,
    /// What limits this log; `None` where nobody looked.
    pub limit: Option<LimitView>,
    /// Where the model fails, in words.
    pub fails_where: Vec<String>,
    /// What may be missing, best first.
    pub suspects: Vec<SuspectView>,
    /// What stands above them.
    pub suspects_head: &'static str,
    /// The ladder's steps.
    pub steps: Vec<StepView>,
    /// Faults of the data, in words.
    pub data_faults: Vec<String>,
    /// Why each effect was named or was not.
    pub explained: Vec<ExplainedView>,
    /// Series for the charts, SI.
    pub detail: Option<AxisDetail>,
    /// Where two models are compared: what the other makes of the rate over time.
    pub other_trace: Option<Trace>,
}

/// Why each effect was named on an axis, or was not.
#[must_use]
pub fn explained(axis: &AxisResult) -> Vec<ExplainedView> {
    axis.explained.iter().map(explained::view).collect()
}

impl Page {
    /// Of `compare`, `diagnose` and `ladder`.
    #[must_use]
    pub fn of(diagnosis: &Diagnosis, context: &Context) -> Self {
        let named: Vec<Named> = diagnosis.axes.iter().map(Named::of).collect();
        let together = Together::of(&named);
        let mut page = Self::axis_by_axis(diagnosis, context);
        for (view, axis) in page.axes.iter_mut().zip(&diagnosis.axes) {
            let searches = matches!(context.command, next::Command::Diagnose | next::Command::Ladder);
            view.ends = searches && axis.finding.is_of_recording();
            view.answer(headline::of_beside(axis, &together.told(axis.axis), context.voice));
        }
        let falls: Vec<Option<Fall>> = diagnosis.axes.iter().map(Fall::of).collect();
        let is_done = context.command == next::Command::Ladder;
        page.story = Story::of(&together, &named, &mut page.axes, &falls, is_done);
        page
    }

    /// The same for a page that shows one axis at a time: each says all that it has.
    #[must_use]
    pub fn axis_by_axis(diagnosis: &Diagnosis, context: &Context) -> Self {
        let title = match context.command {
            next::Command::Diagnose => labels::WHICH,
            next::Command::Ladder => labels::LADDER,
            next::Command::Fit => "The fitted model against measurements",
            _ => "Model against measurements",
        };
        let next = next_of(diagnosis.axes.iter().map(attention), context);
        page(title, &diagnosis.log, diagnosis.axes.iter().map(|axis| AxisView::of(axis, context.voice)).collect(), next)
    }

    /// Of `add` and `remove`.
    #[must_use]
    pub fn of_change(change: &Change, context: &Context) -> Self {
        let changes: Vec<String> = change
            .added
            .iter()
            .map(|e| format!("{e} added"))
            .chain(change.removed.iter().map(|e| format!("{e} removed")))
            .collect();
        let mut axes: Vec<AxisView> = change
            .after
            .axes
            .iter()
            .map(|after| {
                let before = change.before.axes.iter().find(|b| b.axis == after.axis);
                let mut view = AxisView::of_pair((before, "before"), (after, "after"), context.voice);
                view.answer(headline::of_change(change.added, change.removed, before, after, context.voice));
                view
            })
            .collect();
        let named: Vec<Named> = change.after.axes.iter().map(|axis| Named::by_change(change.added, axis)).collect();
        let before = |axis: Axis| change.before.axes.iter().find(|b| b.axis == axis);
        let falls: Vec<Option<Fall>> =
            change.after.axes.iter().map(|axis| Fall::of_change(before(axis.axis), axis)).collect();
        let story = Story::of(&Together::of(&named), &named, &mut axes, &falls, true);
        let next = next_of(change.after.axes.iter().map(attention), context);
        let title = format!("Before and after: {}", changes.join(", "));
        Self { story, ..page(&title, &change.after.log, axes, next) }
    }

    /// Of `compare --against`.
    #[must_use]
    pub fn of_against(against: &Against, context: &Context) -> Self {
        let others = |axis: &AxisResult| against.other.axes.iter().find(|other| other.axis == axis.axis);
        let pairs: Vec<(&AxisResult, Option<&AxisResult>)> =
            against.diagnosis.axes.iter().map(|axis| (axis, others(axis))).collect();
        let named: Vec<Named> =
            pairs.iter().filter_map(|(axis, other)| other.map(|other| headline::by_which(axis, other))).collect();
        let together = Together::of(&named);
        let mut axes: Vec<AxisView> = Vec::new();
        for &(axis, other) in &pairs {
            let mut view = AxisView::of_pair((other, against.other_model), (axis, against.model), context.voice);
            if let Some(other) = other {
                let names = (against.model, against.other_model);
                view.answer(headline::of_against(names, axis, other, &together.told(axis.axis)));
            }
            axes.push(view);
        }
        let besides: Vec<Option<Beside>> =
            pairs.iter().map(|(axis, other)| other.and_then(|other| Beside::of(axis, other))).collect();
        let story = Story::of_two(&together, &besides, &mut axes);
        let next = next_of(against.diagnosis.axes.iter().map(attention), context);
        let title = format!("{} against {}", against.model, against.other_model);
        Self { story, ..page(&title, &against.diagnosis.log, axes, next) }
    }
}

fn page(title: &str, log: &str, axes: Vec<AxisView>, next: Vec<next::Next>) -> Page {
    let version = env!("CARGO_PKG_VERSION");
    Page {
        title: title.into(),
        log: log.into(),
        about: Vec::new(),
        warning: String::new(),
        story: None,
        axes,
        next,
        look: None,
        tests: false,
        product: None,
        version,
    }
}

impl AxisView {
    fn answer(&mut self, spoken: Headline) {
        (self.headline, self.at_source) = (spoken.answer, spoken.at_source);
    }

    fn of(axis: &AxisResult, voice: Voice) -> Self {
        if axis.steps.is_empty() { Self::of_diagnosis(axis, voice) } else { Self::of_ladder(axis, voice) }
    }

    fn of_diagnosis(axis: &AxisResult, voice: Voice) -> Self {
        let mut curves = vec![curve("model", &axis.error_curve)];
        let several = axis.missing.len() > 1;
        if let Some(best) = axis.suspects.first().filter(|_| !axis.corrected_curve().is_empty()) {
            let label = if several { labels::WITH_ALL.to_owned() } else { format!("with {}", best.effect) };
            curves.push(curve(&label, axis.corrected_curve()));
        }
        let best = axis.in_question();
        let suspect = best.map(|s| s.effect.as_str());
        let group: Vec<&str> =
            best.into_iter().flat_map(|s| std::iter::once(&s.effect).chain(&s.aliases)).map(String::as_str).collect();
        let spoken = headline::of(axis, voice);
        Self {
            axis: axis.axis.letter(),
            verdict: axis.verdict,
            at_source: spoken.at_source,
            label: match axis.verdict {
                Verdict::Unexplained if !axis.searched => labels::NOT_SEARCHED.into(),
                Verdict::MissingEffect if several => {
                    format!("missing effects: {}", axis.missing.join(", "))
                }
                verdict => {
                    let aliases = best.map_or(&[][..], |s| &s.aliases);
                    labels::label(verdict, suspect, aliases, axis.limited_by, voice)
                }
            },
            brief: labels::brief(axis.verdict, axis.searched, several, &group),
            tone: tone(axis.verdict),
            says: axis::sentence(&beyond(axis, false, voice)),
            ends: false,
            headline: spoken.answer,
            effects: axis.effects.iter().map(|id| axis::card(id)).collect(),
            parameters: axis::parameters(axis.axis, &axis.parameters, true, voice),
            noise: axis::noise(&axis.noise, axis.verdict),
            curves,
            judged: 0,
            figures: true,
            error_over_floor: axis.error_over_floor.filter(|r| r.is_finite()),
            within_floor: axis.within_floor,
            floor_source: axis.floor_source.clone(),
            drift: drift::says(axis),
            limit: axis::limit(axis, voice),
            // Of many bins that hold noise alone a few stand out.
            fails_where: match axis.verdict {
                Verdict::Adequate => Vec::new(),
                _ => axis.fails_where.iter().map(|f| f.says.clone()).collect(),
            },
            suspects: axis::suspects(axis.axis, &axis.suspects, several, voice),
            suspects_head: labels::suspects(several),
            steps: Vec::new(),
            data_faults: axis.data_faults.iter().map(fault).collect(),
            explained: explained(axis),
            detail: axis.detail.clone(),
            other_trace: None,
        }
    }

    fn of_pair(
        (before, before_label): (Option<&AxisResult>, &str),
        (after, label): (&AxisResult, &str),
        voice: Voice,
    ) -> Self {
        let mut view = Self::of_diagnosis(after, voice);
        view.curves.truncate(1);
        view.curves[0].label = label.into();
        if let Some(before) = before {
            view.curves.insert(0, curve(before_label, &before.error_curve));
            view.judged = 1;
            view.other_trace = before.detail.as_ref().map(|detail| detail.trace.clone());
            view.steps = vec![
                falling(before_label.into(), None, &before.error_curve, before.error_over_floor, &[]),
                falling(label.into(), Some(&before.error_curve), &after.error_curve, after.error_over_floor, &[]),
            ];
        }
        view
    }

    fn of_ladder(axis: &AxisResult, voice: Voice) -> Self {
        let steps: Vec<StepView> = axis
            .steps
            .iter()
            .enumerate()
            .map(|(k, step)| {
                let label = match (&step.added, &step.removed) {
                    (Some(added), Some(removed)) => format!("+ {added} − {removed}"),
                    (Some(added), None) => format!("+ {added}"),
                    (None, Some(removed)) => format!("− {removed}"),
                    (None, None) if k == 0 => "start".into(),
                    (None, None) => "the other axes".into(),
                };
                let before = k.checked_sub(1).map(|k| axis.steps[k].error_curve.as_slice());
                falling(label, before, &step.error_curve, step.error_over_floor, &step.aliases)
            })
            .collect();
        let curves: Vec<Curve> =
            axis.steps.iter().zip(&steps).map(|(step, view)| curve(&view.label, &step.error_curve)).collect();
        let ambiguous = axis.steps.iter().find(|s| !s.aliases.is_empty());
        let (named, aliases) = match (axis.verdict, ambiguous) {
            (Verdict::Ambiguous, Some(step)) => (step.added.as_deref(), step.aliases.as_slice()),
            _ => (None, &[][..]),
        };
        let last = axis.steps.last();
        let is_within = |p: &ErrorPoint| p.error.zip(p.floor_99).is_none_or(|(error, top)| error <= top);
        let within_floor = last.map(|step| step.error_curve.iter().all(is_within));
        let spoken = headline::of(axis, voice);
        Self {
            at_source: spoken.at_source,
            label: labels::label(axis.verdict, named, aliases, axis.limited_by, voice),
            brief: labels::brief(
                axis.verdict,
                true,
                false,
                &named.into_iter().chain(aliases.iter().map(String::as_str)).collect::<Vec<_>>(),
            ),
            says: axis::sentence(&beyond(axis, headline::has_additions(axis), voice)),
            headline: spoken.answer,
            judged: curves.len().saturating_sub(1),
            figures: true,
            curves,
            within_floor,
            floor_source: String::new(),
            fails_where: match axis.verdict {
                Verdict::Adequate => Vec::new(),
                _ if within_floor == Some(true) => Vec::new(),
                _ => axis.fails_where.iter().map(|f| f.says.clone()).collect(),
            },
            suspects_head: "",
            steps,
            ..Self::of_diagnosis(axis, voice)
        }
    }
}

/// What the next command depends on: axis, verdict, error/floor, what is missing.
type Attention<'a> = (Axis, Verdict, Option<f64>, Vec<&'a str>);

fn attention(axis: &AxisResult) -> Attention<'_> {
    let missing = axis.missing.iter().map(String::as_str);
    let suspects = if axis.missing.is_empty() {
        axis.suspects.iter().take(1).map(|s| s.effect.as_str()).collect()
    } else {
        missing.collect()
    };
    (axis.axis, axis.verdict, axis.error_over_floor, suspects)
}

/// The axis that needs attention most decides.
fn next_of<'a>(axes: impl Iterator<Item = Attention<'a>>, context: &Context) -> Vec<next::Next> {
    let axes: Vec<Attention> = axes.collect();
    let urgency = |verdict: Verdict| match verdict {
        Verdict::BadData => 5,
        Verdict::MissingEffect => 4,
        Verdict::Ambiguous => 3,
        Verdict::Unexplained => 2,
        Verdict::CannotTell => 1,
        Verdict::Adequate => 0,
    };
    let worst = axes
        .iter()
        .max_by(|a, b| urgency(a.1).cmp(&urgency(b.1)).then(a.2.unwrap_or(0.0).total_cmp(&b.2.unwrap_or(0.0))));
    worst.map_or_else(Vec::new, |(axis, verdict, _, suspects)| {
        let alone = axes.iter().any(|a| a.0 != *axis && a.3 != *suspects);
        next::next(&next::Finding { axis: *axis, alone, verdict: *verdict, suspects }, context)
    })
}
