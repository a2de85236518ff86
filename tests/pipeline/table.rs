//! How much data it takes, effect by effect, over the live pipeline and offline. Not run with the other tests:
//!
//! ```console
//! $ cargo test --test pipeline every_effect -- --ignored --nocapture
//! ```
//!
//! `TRUERATE_EFFECTS=delay,lag` picks effects, `TRUERATE_MOTION` (`drive`) and `TRUERATE_SEED` (1) the vehicle,
//! `TRUERATE_TIMES` (2) how many times faster than real time it drives.

use crate::{
    harness::{Pipeline, Place},
    setting,
};
use gyro_model::{
    Axis, Model, Record,
    diagnose::{Options, ladder},
    effects::CATALOGUE,
    simulate::Simulator,
};
use ipc_types::{
    Diagnosis,
    port::{Hub, Reader},
    topic,
    wait::Wait,
};
use std::time::{Duration, Instant};
use truerate::{settings::Settings, source::scenario};

const RATE_HZ: f64 = 100.0;
/// No effect gets more data than that, s.
const MOST: f64 = 300.0;
/// The error counts as at its floor below this ratio, or inside the floor's band.
const AT_FLOOR: f64 = 1.2;
/// Between two prefixes that are tried offline.
const STEP: f64 = 1.25;
/// The shortest of them, s.
const SHORTEST: f64 = 4.0;

/// One line of the table: seconds of data, where it came to that.
struct Line {
    offline: Option<f64>,
    named: Option<f64>,
    alone: bool,
    floor: Option<f64>,
}

struct Onlooker {
    diagnoses: Reader<Diagnosis>,
    axis: usize,
    until: Instant,
    _hub: Hub,
}

impl Onlooker {
    fn join(pipeline: &mut Pipeline, axis: Axis, times: f64) -> Self {
        let mut joined = None;
        pipeline.until("the topics", |p| {
            joined = Hub::join(&p.domain, "onlooker")
                .ok()
                .and_then(|hub| hub.reader(&topic::DIAGNOSIS, None, Wait::Event).ok().map(|reader| (hub, reader)));
            joined.is_some()
        });
        let (hub, diagnoses) = joined.unwrap();
        let until = Instant::now() + Duration::from_secs_f64(MOST / times);
        Self { diagnoses, axis: axis.index(), until, _hub: hub }
    }

    /// The data's length, s, at the first diagnosis of this kind; `None` where the vehicle has driven long enough.
    fn first(&self, mut is: impl FnMut(&Diagnosis, &ipc_types::diagnosis::AxisResult) -> bool) -> Option<f64> {
        while Instant::now() < self.until {
            if let Some(diagnosis) = self.diagnoses.newest().unwrap()
                && diagnosis.axes[self.axis].present == 1
                && is(&diagnosis, &diagnosis.axes[self.axis])
            {
                return Some(diagnosis.to_ns as f64 * 1e-9);
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        None
    }
}

/// The shortest prefix of the stream on whose ladder the effect is the first step, s.
fn offline(settings: &Settings, axis: Axis, id: &str) -> Option<f64> {
    let mut simulator = Simulator::new(&scenario(settings).unwrap());
    let mut record = Record::default();
    let mut seconds = SHORTEST;
    while seconds <= MOST {
        while (record.len() as f64) < seconds * RATE_HZ {
            record.rows.push(simulator.step().row);
        }
        let climbed = ladder(&record, &Model::base_for(&record), &[axis], &Options::default());
        let first = climbed.ok().and_then(|(_, axes)| axes[0].steps.get(1).and_then(|step| step.added.clone()));
        if first.as_deref() == Some(id) {
            return Some(seconds);
        }
        seconds *= STEP;
    }
    None
}

fn measure(place: &Place, id: &str, seed: u64, times: f64) -> Line {
    let motion = setting("TRUERATE_MOTION", "drive");
    let text = format!(
        "speed = {times}\nhide = [\"{id}\"]\ndashboard = \"off\"\n[simulation]\nmotion = \"{motion}\"\nrate_hz = \
         {RATE_HZ:.1}\nseed = {seed}\n"
    );
    let config = place.file("vehicle.toml");
    std::fs::write(&config, text).unwrap();
    let settings = Settings::read(&config).unwrap();
    let axis = scenario(&settings).unwrap().sensor.axis;

    let mut pipeline = place.start("table", &["--config", config.to_str().unwrap()]);
    pipeline.until += Duration::from_secs_f64(MOST / times);
    let onlooker = Onlooker::join(&mut pipeline, axis, times);
    let mut alone = false;
    let named = onlooker.first(|_, axis| {
        alone = axis.verdict.as_str() == "missing-effect";
        (alone || axis.verdict.as_str() == "ambiguous") && axis.suspects[0].effect.as_str() == id
    });
    let mut floor = None;
    if named.is_some() {
        let add = ["control", "--instance", "table", "add", id, "--axis", axis.letter()];
        // A name may come before there is a model to add to.
        let added = (0..20).any(|_| place.output(&add).status.success());
        let epoch = added.then(|| place.status("table")).flatten();
        let epoch = epoch.and_then(|status| status["services"][2]["epoch"].as_u64());
        floor = epoch.and_then(|epoch| {
            onlooker.first(|diagnosis, axis| {
                let at_floor = axis.within_floor == 1 || axis.error_over_floor <= AT_FLOOR;
                diagnosis.epoch >= epoch && diagnosis.trial.state == TOOK_OVER && at_floor
            })
        });
    }
    drop(onlooker);
    pipeline.interrupt();
    Line { offline: offline(&settings, axis, id), named, alone, floor }
}

const TOOK_OVER: u32 = ipc_types::diagnosis::TrialState::TookOver as u32;

#[test]
#[ignore = "takes half an hour and prints a table"]
fn every_effect_hidden_from_the_start_is_named_added_and_at_its_floor_after_this_much_data() {
    let place = Place::new();
    let picked = setting("TRUERATE_EFFECTS", "");
    let seed: u64 = setting("TRUERATE_SEED", "1").parse().unwrap();
    let times: f64 = setting("TRUERATE_TIMES", "2").parse().unwrap();
    let shown = |value: Option<f64>| value.map_or_else(|| format!("not in {MOST:.0}"), |v| format!("{v:.0}"));
    println!("| effect | offline, s | live, s | live/offline | at its floor, s |");
    println!("| --- | --- | --- | --- | --- |");
    let mut ratios = Vec::new();
    for effect in CATALOGUE {
        let id = effect.card().id;
        if ["scale-factor", "bias"].contains(&id) || !(picked.is_empty() || picked.split(',').any(|p| p == id)) {
            continue;
        }
        let line = measure(&place, id, seed, times);
        let ratio = line.named.zip(line.offline).map(|(live, offline)| live / offline);
        ratios.extend(ratio);
        let ratio = ratio.map_or_else(|| "–".to_owned(), |r| format!("{r:.1}"));
        let alone = if line.alone || line.named.is_none() { "" } else { " (ambiguous)" };
        let floor = if line.named.is_some() { shown(line.floor) } else { "–".to_owned() };
        println!("| `{id}` | {} | {}{alone} | {ratio} | {floor} |", shown(line.offline), shown(line.named));
    }
    ratios.sort_by(f64::total_cmp);
    if let Some(median) = ratios.get(ratios.len() / 2) {
        println!("\nmedian of live/offline over {} effects: {median:.1}", ratios.len());
    }
}
