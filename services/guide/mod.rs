//! `truerate guide`: rows come, go to the log, and to a [`gyro_model::guide::Guide`], which says what the hand is to do next.
//!
//! ```text
//! source ──▶ log (every row, at once)
//!        └─▶ guide ──▶ show (terminal, lines, JSON; a page beside them)
//!              ▲ └──▶ worker: fits, rehearses, searches, beside the rows
//!              └────────┘
//! ```

mod ending;
mod goal;
mod json;
mod lines;
mod page;
mod precision;
mod recording;
mod screen;
mod skipping;
mod source;
mod worker;

pub use ending::Ending;
pub use precision::Precisions;
pub use source::From;

use crate::{listening::Address, live::words, stop::Stop};
use anyhow::{Result, bail};
use gyro_model::{
    Axis, Record, Row,
    effects::{Effect, find},
    guide::{Guide, Stage, State, Wanted},
};
use ipc_types::health::SourceHealth;
use recording::Recording;
use skipping::Skips;
use source::{Next, Source};
use std::{
    path::PathBuf,
    time::{Duration, Instant},
};
use workbench::log::GrowingLog;

/// What is recorded, from where, and what is wanted of it.
pub struct Settings {
    /// Where rows come from.
    pub from: From,
    /// The log.
    pub log: PathBuf,
    /// These axes; none: all that have a reference.
    pub axes: Vec<Axis>,
    /// These effects; `None`: whatever is missing.
    pub effects: Option<Vec<&'static dyn Effect>>,
    /// Whether it has a course of temperatures.
    pub temperature: bool,
    /// How well.
    pub precisions: Precisions,
    /// Events as JSON, a line each.
    pub json: bool,
    /// Where a page shows the same; `None` for no page.
    pub dashboard: Option<Address>,
}

/// What must be known of any gyro before what is missing shows.
pub const USUAL: [&str; 3] = ["scale-factor", "bias", "delay"];
/// How often it is shown how it stands.
const SHOWS: Duration = Duration::from_millis(500);
/// The first rows say what the source has, s.
const FIRST: f64 = 1.0;
/// A source that gives no reference for so long is said to have none, s.
const NO_REFERENCE: f64 = 5.0;

/// What is shown, and how.
trait Show {
    /// There is no row that can be used yet, and why.
    fn waits(&mut self, says: &str) -> Result<()>;
    /// How it stands.
    fn state(&mut self, state: &State, source: Option<&str>) -> Result<()>;
    /// What it came to.
    fn end(&mut self, ending: &Ending) -> Result<()>;
}

/// Records until all is told, or until it is stopped.
///
/// # Errors
/// A log that stands there, a source that cannot be read, an axis that it does not have.
pub fn run(settings: &Settings, stop: &Stop) -> Result<Ending> {
    let mut show: Box<dyn Show> = if settings.json {
        Box::new(json::Json::new(&settings.log))
    } else if screen::is_wanted() {
        Box::new(screen::Screen::default())
    } else {
        Box::new(lines::Lines::default())
    };
    if let Some(address) = settings.dashboard {
        show = Box::new(page::Page::open(address, &settings.log, show)?);
    }
    let mut log = GrowingLog::create(&settings.log)?;
    let recorded = record(settings, stop, &mut log, show.as_mut());
    // Whatever happened, what was recorded stays.
    log.finish()?;
    let (guide, interrupted) = recorded?;
    let ending = Ending::new(guide.as_ref(), settings, interrupted);
    show.end(&ending)?;
    Ok(ending)
}

/// Records; the guide, where there was a row to begin with, and whether it was stopped.
fn record(
    settings: &Settings,
    stop: &Stop,
    log: &mut GrowingLog,
    show: &mut dyn Show,
) -> Result<(Option<Guide>, bool)> {
    let mut shown = Instant::now();
    show.waits("for the first row")?;
    let opened = Source::open(&settings.from, stop, |health| {
        if shown.elapsed() > SHOWS {
            shown = Instant::now();
            show.waits(&format!("for the first row: {}", words::text(health).unwrap_or_default()))?;
        }
        Ok(())
    });
    let Some(mut source) = opened? else { return Ok((None, true)) };
    let Some(first) = first_rows(&mut source, stop, show)? else { return Ok((None, stop.asked())) };
    log.begin(&first, source.origin().map_or(0, |origin| origin.start_ns))?;
    let mut recording = Recording::begin(log, &first, guide(settings, &first)?)?;
    let skips = Skips::listen(&settings.from);
    while recording.guide.state().stage != Stage::Over {
        if stop.asked() {
            return Ok((Some(recording.guide), true));
        }
        if skips.asked() {
            recording.guide.skip();
        }
        let is_over = recording.take(&mut source)?;
        recording.ask(is_over);
        let learned = recording.learn(source.waits() || is_over)?;
        let state = recording.guide.state();
        if is_over && state.stage == Stage::Recording {
            show.state(&state, None)?;
            return Ok((Some(recording.guide), false));
        }
        if learned || shown.elapsed() > SHOWS {
            shown = Instant::now();
            show.state(&state, trouble_of(&source.health()).as_deref())?;
            source.hears(&state);
        }
    }
    Ok((Some(recording.guide), false))
}

/// The rows of the first second in which there is a reference; `None` where it ends or is stopped before.
fn first_rows(source: &mut Source, stop: &Stop, show: &mut dyn Show) -> Result<Option<Record>> {
    let free_names = source.origin().map(|origin| origin.content.free_names.clone()).unwrap_or_default();
    let mut first = Record { free_names, ..Record::default() };
    let mut shown = Instant::now();
    let mut referenced_ns: Option<i64> = None;
    while !stop.asked() {
        match source.next(Duration::from_millis(20))? {
            Next::Row(row) => {
                referenced_ns = referenced_ns.or_else(|| has_reference(&row).then_some(row.t_ns));
                first.rows.push(row);
                if referenced_ns.is_some_and(|ns| (row.t_ns - ns) as f64 * 1e-9 >= FIRST)
                    && !first.fitted_axes().is_empty()
                {
                    return Ok(Some(first));
                }
            }
            Next::Later => {}
            Next::End if first.fitted_axes().is_empty() => bail!("{NOTHING_TO_GO_BY}"),
            Next::End => return Ok(Some(first)),
        }
        // What comes before the reference is there is of no use.
        if referenced_ns.is_none() && first.duration() > 2.0 * NO_REFERENCE {
            let half = first.rows.len() / 2;
            first.rows.drain(..half);
        }
        if shown.elapsed() > SHOWS {
            shown = Instant::now();
            let late = first.duration() > NO_REFERENCE;
            show.waits(if late { NOTHING_TO_GO_BY } else { "for the first second of rows with a reference" })?;
        }
    }
    Ok(None)
}

const NOTHING_TO_GO_BY: &str = "no axis has both a gyro and a reference in these rows: give a column ref_angle_z, ref_rate_z or ref_qw … ref_qz, or say \
     where the reference comes from with --reference ADDRESS (docs/feed.md)";

fn has_reference(row: &Row) -> bool {
    row.ref_angle.iter().chain(&row.ref_rate).chain(&row.ref_quaternion).any(|value| value.is_finite())
}

/// A guide for what is wanted, on the axes that the source has.
fn guide(settings: &Settings, first: &Record) -> Result<Guide> {
    let fitted = first.fitted_axes();
    if let Some(axis) = settings.axes.iter().find(|axis| !fitted.contains(axis)) {
        let has: Vec<&str> = fitted.iter().map(|axis| axis.letter()).collect();
        bail!("axis {axis} has no gyro or no reference in this source: choose from {}", has.join(", "));
    }
    let axes = if settings.axes.is_empty() { fitted } else { settings.axes.clone() };
    let usual = || USUAL.iter().filter_map(|id| find(id)).collect();
    let effects: Vec<&'static dyn Effect> = settings.effects.clone().unwrap_or_else(usual);
    let effects = effects.into_iter().map(|effect| (effect, settings.precisions.of(effect.card().id))).collect();
    let has_temperature = first.rows.iter().any(|row| row.temperature.is_finite());
    if settings.temperature && !has_temperature {
        bail!(
            "the source gives no temperature of the gyro, and a course of temperatures needs one: name its channel with --map temp=CHANNEL"
        );
    }
    let mut guide =
        Guide::new(Wanted { axes, effects, course: settings.effects.is_none(), temperature: settings.temperature });
    guide.check(first);
    Ok(guide)
}

/// What is wrong with the link, in words.
fn trouble_of(health: &SourceHealth) -> Option<String> {
    use ipc_types::health::Link;
    let bad = [Link::Silent, Link::Lost, Link::Waiting].iter().any(|link| *link as u32 == health.link);
    bad.then(|| format!("no rows come: the source is {}", words::text(health).unwrap_or_default()))
}
