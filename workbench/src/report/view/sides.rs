//! Two sensors side by side: one sentence, a table of sizes, and both curves.

use super::{AxisView, Page, Row, Story, axis, page};
use crate::report::{BothSides, Context, next::Next, units};
use gyro_model::{
    diagnosis::AxisResult,
    headline::sides::{AtTime, Quantity, Sides, Which},
    words::{Voice, shell_word},
};

/// Heads of the table.
const HEAD: [&str; 4] = ["", "first", "second", "better"];

impl Page {
    /// Of `compare --side-by-side`.
    #[must_use]
    pub fn of_sides(both: &BothSides, context: &Context) -> Self {
        let of = |k: usize, sides: &Sides| both.diagnoses[k].axes.iter().find(|axis| axis.axis == sides.axis);
        let mut axes = Vec::new();
        let mut rows = Vec::new();
        for sides in &both.sides {
            let (Some(first), Some(second)) = (of(0, sides), of(1, sides)) else { continue };
            axes.push(view(first, second, both, sides, context.voice));
            rows.extend(rows_of(sides, both));
        }
        let [first, second] = &both.names;
        let story = Some(Story { shared: Vec::new(), head: HEAD, rows, faults: Vec::new() });
        let title = format!("{first} (first) beside {second} (second)");
        let next = both.sides.first().map_or_else(Vec::new, |sides| next(sides, context));
        Self { story, ..page(&title, "", axes, next) }
    }
}

/// The two curves of an axis, and what they come to.
fn view(first: &AxisResult, second: &AxisResult, both: &BothSides, sides: &Sides, voice: Voice) -> AxisView {
    let [one, two] = &both.names;
    let pair = AxisView::of_pair((Some(first), one), (second, two), voice);
    let tone = match sides.better {
        Some(_) => "good",
        None => "unknown",
    };
    AxisView {
        headline: sides.says.clone(),
        at_source: String::new(),
        label: match sides.better {
            Some(Which::First) => format!("better: {one} (first)"),
            Some(Which::Second) => format!("better: {two} (second)"),
            None if sides.errors.iter().any(|own| own.better.is_some()) => "each is better over its own times".to_owned(),
            None => "no difference is seen".to_owned(),
        },
        says: "Each curve is what a log's own model leaves (scale factor and bias, where none is given). It depends on the motion too: the \
               comparison is fairest where both sensors moved together."
            .to_owned(),
        tone,
        figures: false,
        parameters: Vec::new(),
        noise: String::new(),
        limit: None,
        fails_where: Vec::new(),
        suspects: Vec::new(),
        steps: Vec::new(),
        drift: String::new(),
        detail: None,
        other_trace: None,
        data_faults: faults(first, second),
        ..pair
    }
}

/// What is faulty in either log.
fn faults(first: &AxisResult, second: &AxisResult) -> Vec<String> {
    let of = |name: &str, own: &AxisResult| -> Vec<String> {
        own.data_faults.iter().map(|fault| format!("{name}: {}", axis::fault(fault))).collect()
    };
    [of("first", first), of("second", second)].concat()
}

fn rows_of(sides: &Sides, both: &BothSides) -> Vec<Row> {
    let of = if both.sides.len() > 1 { format!("{} ", sides.axis) } else { String::new() };
    let errors = sides.errors.iter().map(|own| error_row(own, &of));
    sides.quantities.iter().map(|own| size_row(own, &of)).chain(errors).collect()
}

fn size_row(own: &Quantity, axis: &str) -> Row {
    let unit = units::shown(own.unit, &own.values);
    let told = |k: usize| units::uncertain(own.values[k], own.std_errors[k], &unit);
    let better = match (own.better, own.values) {
        (Some(which), [Some(a), Some(b)]) => {
            let (a, b) = (a.abs(), b.abs());
            format!("{}, {} times", word(which), units::ratio(if a > b { a / b } else { b / a }))
        }
        _ => "–".to_owned(),
    };
    Row { axis: format!("{axis}{}", own.name), cells: [told(0), told(1), better], ..Row::default() }
}

fn error_row(own: &AtTime, axis: &str) -> Row {
    let told = |k: usize| format!("{} °/s", units::rate(Some(own.errors[k])));
    let better = match own.better {
        Some(which) => {
            let fold = |ratio: f64| if which == Which::Second { ratio } else { 1.0 / ratio };
            let mut band = [fold(own.low), fold(own.high)];
            band.sort_by(f64::total_cmp);
            format!(
                "{}, {} times ({} to {})",
                word(which),
                units::ratio(fold(own.ratio)),
                units::ratio(band[0]),
                units::ratio(band[1])
            )
        }
        None => format!("– (first ÷ second {} to {})", units::ratio(own.low), units::ratio(own.high)),
    };
    Row {
        axis: format!("{axis}error over {}", units::time(own.tau_s)),
        cells: [told(0), told(1), better],
        ..Row::default()
    }
}

const fn word(which: Which) -> &'static str {
    match which {
        Which::First => "first",
        Which::Second => "second",
    }
}

/// Why the worse one is worse.
fn next(sides: &Sides, context: &Context) -> Vec<Next> {
    let worse = match sides.better {
        Some(Which::First) => context.more.first(),
        _ => Some(&context.log),
    };
    // A user of the library types no command.
    if matches!(context.voice, Voice::Library | Voice::Page) {
        return Vec::new();
    }
    let words = |log: &str| -> String {
        std::iter::once(log)
            .chain(context.flags.iter().map(String::as_str))
            .map(shell_word)
            .collect::<Vec<_>>()
            .join(" ")
    };
    let of = |log: &String| Next {
        command: format!("truerate diagnose {}", words(log)),
        says: "which effect makes the error of this one".to_owned(),
    };
    worse.map(of).into_iter().collect()
}
