//! The demo's player: looks at a running pipeline as a person would, names what is missing, adds it, sees the error fall.

use crate::clock::now_ns;
use crate::{
    agreement::{AGREE, is_named, seen_ns},
    ask::ask,
    domain,
    settings::Simulation,
    stop::Stop,
    watch::Watch,
};
use anyhow::Context;
use gyro_model::{Axis, units, words::labels};
use ipc_types::{Command, Diagnosis, Text, command::Kind, diagnosis::AxisResult, port::Reader, topic, wait::Wait};
use std::{
    thread::sleep,
    time::{Duration, Instant},
};
use workbench::{
    output::print,
    vehicle::{RATE_HZ, SWING, SWING_PERIOD},
};

/// Times real time when nobody watches.
pub const SPEED: f64 = 8.0;

/// Data before the first verdict counts, ns.
const ENOUGH_NS: i64 = 60_000_000_000;
/// Judgements of the changed model that are waited for at most until its error is inside the floor's band.
const SETTLES: usize = 10;
const PATIENCE: Duration = Duration::from_secs(240);

/// The vehicle of this seed, as settings.
#[must_use]
pub fn vehicle(seed: u64) -> Simulation {
    Simulation { rate_hz: RATE_HZ, seed, swing: Some(SWING), swing_period: Some(SWING_PERIOD), ..Simulation::default() }
}

/// What to look at, for somebody who does: the dashboard's address, where there is one; the axis on the shaft, of a simulated
/// vehicle.
#[must_use]
pub fn invitation(source: &str, instance: &str, dashboard: Option<&str>, axis: Option<Axis>) -> String {
    let look = dashboard.map_or_else(
        || format!("  truerate top --instance {instance}      watch it in another terminal\n"),
        |url| format!("  {url}      open this in a browser, and do what it says\n"),
    );
    let hidden = if axis.is_some() { "An effect is hidden in its gyro. " } else { "" };
    let axis = axis.map_or("AXIS", |axis| axis.letter());
    format!(
        "{source} runs. {hidden}Ctrl-C ends it.\n{look}  truerate status --instance {instance}\n  \
         truerate control add EFFECT --axis {axis} --instance {instance}      what you think it is\n  \
         truerate control undo --instance {instance}"
    )
}

/// What came of a play.
#[derive(Debug)]
pub struct Played {
    /// The effect that was named; `none`.
    pub named: String,
    /// Largest error over floor before anything was added.
    pub before: f64,
    /// The same at the end.
    pub after: f64,
}

/// The player's ports.
pub struct Player {
    watch: Watch,
    diagnoses: Reader<Diagnosis>,
    started: Instant,
}

impl Player {
    /// Joins the pipeline as soon as it is there; `None` when asked to stop before.
    ///
    /// # Errors
    /// Where it does not come.
    pub fn join(instance: &str, stop: &Stop) -> anyhow::Result<Option<Self>> {
        let started = Instant::now();
        while !stop.asked() {
            match Self::try_join(instance, started) {
                Ok(player) => return Ok(Some(player)),
                Err(error) if started.elapsed() > Duration::from_secs(20) => return Err(error),
                Err(_) => sleep(Duration::from_millis(50)),
            }
        }
        Ok(None)
    }

    fn try_join(instance: &str, started: Instant) -> anyhow::Result<Self> {
        let watch = Watch::join(&domain::existing(instance)?, "player")?;
        let diagnoses = watch.hub.reader(&topic::DIAGNOSIS, None, Wait::Event)?;
        Ok(Self { watch, diagnoses, started })
    }

    /// Plays the loop; `None` when asked to stop.
    ///
    /// # Errors
    /// Where the pipeline does not answer.
    pub fn play(&self, stop: &Stop) -> anyhow::Result<Option<Played>> {
        let Some((axis, place, seconds)) = self.wait_for_name(stop)? else { return Ok(None) };
        let before = axis.error_over_floor;
        let suspect = axis.suspects[0];
        let named = suspect.effect.as_str().to_owned();
        if named.is_empty() {
            print(&format!("after {seconds:.0} s of driving: {}", labels::NOTHING))?;
            return Ok(Some(Played { named: "none".to_owned(), before, after: before }));
        }
        let letter = Axis::ALL[place].letter();
        print(&format!(
            "compare:  after {seconds:.0} s of driving the error of axis {letter} is up to {before:.2} times the floor"
        ))?;
        let aliases = suspect.aliases.as_str();
        let aliases = if aliases.is_empty() { String::new() } else { format!(" (or on this drive also {aliases})") };
        print(&format!(
            "diagnose: missing effect {named}{aliases}; adding it removes {} of the error above the floor",
            // What a fit leaves may lie below the noise that was expected.
            units::percent(suspect.error_fall.clamp(0.0, 1.0))
        ))?;
        let command = Command {
            id: now_ns(),
            kind: Kind::Add as u32,
            axis: place as u32,
            effect: Text::new(&named),
            ..Command::default()
        };
        let reply = ask(&self.watch.hub, command)?;
        // How the error falls is told over the same samples as before, below.
        print(&format!("add:      {}", reply.says.as_str().split(" (").next().unwrap_or_default()))?;
        let Some(after) = self.wait_for_fall(place, &named, reply.epoch, stop)? else { return Ok(None) };
        let band = if after.within_floor == 1 { ", which is noise" } else { "" };
        let after = after.error_over_floor;
        print(&format!("compare:  the error is up to {after:.2} times the floor{band}"))?;
        Ok(Some(Played { named, before, after }))
    }

    /// The worst axis once a name is given again and again, or there is none to give.
    fn wait_for_name(&self, stop: &Stop) -> anyhow::Result<Option<(AxisResult, usize, f64)>> {
        while !stop.asked() {
            let Some(diagnosis) = self.next(stop)? else { return Ok(None) };
            let Some((place, axis)) = worst(&diagnosis) else { continue };
            let seconds = seen_ns(&diagnosis) as f64 * 1e-9;
            let (verdict, suspect) = (axis.verdict.as_str(), axis.suspects[0].effect.as_str());
            tracing::info!(seconds, verdict, suspect, "judged");
            let wanted = if is_named(axis) { AGREE } else { 8 * AGREE };
            if seen_ns(&diagnosis) >= ENOUGH_NS && axis.agreed >= wanted {
                let mut axis = *axis;
                if !is_named(&axis) {
                    axis.suspects[0].effect = Text::EMPTY;
                }
                return Ok(Some((axis, place, seconds)));
            }
        }
        Ok(None)
    }

    /// The changed model's judgement: the first one at its floor, or the last of some.
    fn wait_for_fall(&self, place: usize, named: &str, epoch: u64, stop: &Stop) -> anyhow::Result<Option<AxisResult>> {
        let (mut parameters, mut judged) = (None, 0);
        let reader = self.watch.hub.reader(&topic::PARAMETERS, None, Wait::Event)?;
        while !stop.asked() {
            let Some(diagnosis) = self.next(stop)? else { return Ok(None) };
            parameters = reader.newest()?.or(parameters);
            let has = parameters.is_some_and(|p| {
                let axis = &p.axes[place];
                axis.terms.iter().take(axis.count as usize).any(|term| term.effect.as_str() == named)
            });
            let axis = &diagnosis.axes[place];
            if has && diagnosis.epoch >= epoch && axis.present == 1 {
                judged += 1;
                let still = axis.suspects.iter().any(|s| s.effect.as_str() == named);
                if !still && (axis.within_floor == 1 || judged >= SETTLES) {
                    return Ok(Some(*axis));
                }
            }
        }
        Ok(None)
    }

    fn next(&self, stop: &Stop) -> anyhow::Result<Option<Diagnosis>> {
        while !stop.asked() {
            if let Some(diagnosis) = self.diagnoses.newest()? {
                return Ok(Some(diagnosis));
            }
            (self.started.elapsed() < PATIENCE)
                .then_some(())
                .context("no diagnosis in time: is the machine overloaded?")?;
            sleep(Duration::from_millis(20));
        }
        Ok(None)
    }
}

/// The axis with the largest error over floor.
fn worst(diagnosis: &Diagnosis) -> Option<(usize, &AxisResult)> {
    let axes = diagnosis.axes.iter().enumerate().filter(|(_, axis)| axis.present == 1);
    axes.max_by(|(_, a), (_, b)| a.error_over_floor.total_cmp(&b.error_over_floor))
}

#[cfg(test)]
mod tests {
    use super::{invitation, vehicle};
    use crate::{settings::Settings, source::scenario};
    use gyro_model::Axis;
    use workbench::vehicle as pure;

    #[test]
    fn the_vehicle_of_a_seed_is_the_one_that_the_settings_describe() {
        let settings = Settings { simulation: vehicle(7), ..Settings::default() };
        assert_eq!(format!("{:?}", scenario(&settings).unwrap()), format!("{:?}", pure::scenario(7).unwrap()));
    }

    #[test]
    fn the_axis_that_is_told_is_the_vehicles_own_and_a_log_has_any() {
        for axis in Axis::ALL {
            let text = invitation("a vehicle", "demo", None, Some(axis));
            assert!(text.contains(&format!("--axis {axis} ")) && text.contains("is hidden in its gyro"), "{text}");
        }
        let text = invitation("log.csv", "demo", Some("http://127.0.0.1:7777/"), None);
        assert!(text.contains("--axis AXIS ") && !text.contains("hidden") && text.contains("7777/ "), "{text}");
    }
}
