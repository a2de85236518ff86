//! Takes what comes on the topics and turns it into what there is to see.

use super::{
    judgement,
    model::{self, changes},
    scene::{Mark, Scene},
};
use crate::clock::now_ns;
use crate::{
    agreement::looking,
    live::words,
    pulse::Pulse,
    run_folder::{Run, RunFolder},
    supervisor::board::Board,
    wire,
};
use gyro_model::{
    Axis, Row,
    diagnosis::Diagnosis,
    estimator::{self, flags},
};
use ipc_types::{
    Estimate, Health, Histogram, MARK_DATA, Parameters, Sample, Status,
    port::{BytesReader, Hub, Reader},
    topic,
    wait::Wait,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use workbench::{motion::Motion, story};

/// Between two looks at the latencies, ns.
const STAGES_NS: u64 = 1_000_000_000;
/// Between two points of a parameter's history, ns.
const VALUES_NS: u64 = 500_000_000;

/// Between two marks of what the filter noticed, ns.
const APART_NS: i64 = 10_000_000_000;

/// The ports, and what was seen last.
pub(super) struct Feed {
    samples: Reader<Sample>,
    estimates: Reader<Estimate>,
    parameters: Reader<Parameters>,
    diagnoses: Reader<ipc_types::Diagnosis>,
    reports: BytesReader,
    statuses: Reader<Status>,
    healths: Reader<Health>,
    scene: Scene,
    run: u64,
    instance: String,
    folder: RunFolder,
    motion: Motion,
    board: Board,
    rows: Vec<Row>,
    model: Option<Parameters>,
    has_report: bool,
    named: bool,
    changed_ns: i64,
    /// Time of the last estimate that a reference contradicted, ns.
    contradicted_ns: i64,
    sequence: u64,
    stages_ns: u64,
    values_ns: u64,
    hide: Vec<String>,
    t: f64,
}

impl Feed {
    /// Opens every topic that a watcher reads.
    pub(super) fn open(hub: &Hub, run: &Run, folder: &RunFolder, instance: &str, scene: Scene) -> anyhow::Result<Self> {
        Ok(Self {
            samples: hub.reader(&topic::SAMPLE, None, Wait::Spin)?,
            estimates: hub.reader(&topic::ESTIMATE, None, Wait::Spin)?,
            parameters: hub.reader(&topic::PARAMETERS, None, Wait::Spin)?,
            diagnoses: hub.reader(&topic::DIAGNOSIS, None, Wait::Spin)?,
            reports: hub.bytes_reader(&topic::REPORT)?,
            statuses: hub.reader(&topic::STATUS, None, Wait::Spin)?,
            healths: hub.reader(&topic::HEALTH, None, Wait::Spin)?,
            scene,
            run: run.number,
            instance: instance.to_owned(),
            folder: folder.clone(),
            motion: Motion::default(),
            board: Board::default(),
            rows: Vec::new(),
            model: None,
            has_report: false,
            named: false,
            changed_ns: 0,
            contradicted_ns: i64::MIN,
            sequence: 0,
            stages_ns: 0,
            values_ns: 0,
            hide: run.settings.hide.clone(),
            t: 0.0,
        })
    }

    /// One look at everything.
    pub(super) fn turn(&mut self, pulse: &mut Pulse) -> anyhow::Result<()> {
        self.samples()?;
        self.estimates(pulse)?;
        self.scene.move_on(self.motion.steps());
        self.scene.keep_rows(&mut self.rows);
        // What was learned may be known before a sample comes; then it tells the time.
        self.diagnoses()?;
        self.parameters(pulse)?;
        self.health()?;
        self.name();
        Ok(())
    }

    fn samples(&mut self) -> anyhow::Result<()> {
        while let Some(sample) = self.samples.take()? {
            if sample.run == self.run && sample.mark == MARK_DATA {
                let row = wire::row_of(&sample);
                self.motion.row(&row);
                self.t = sample.time_ns as f64 * 1e-9;
                self.rows.push(row);
            }
        }
        Ok(())
    }

    fn estimates(&mut self, pulse: &mut Pulse) -> anyhow::Result<()> {
        while let Some(estimate) = self.estimates.take()? {
            if estimate.run != self.run || estimate.sequence <= self.sequence {
                continue;
            }
            if self.sequence > 0 {
                pulse.health.lost += estimate.sequence - self.sequence - 1;
            }
            self.sequence = estimate.sequence;
            pulse.health.received += 1;
            pulse.health.acknowledged = estimate.sequence;
            pulse.health.stages[0].record(now_ns().saturating_sub(estimate.kalman_gave_ns));
            if estimate.mark == MARK_DATA {
                let estimate = wire::estimate_of(&estimate);
                self.contradicted(&estimate);
                self.motion.estimate(&estimate);
            }
        }
        Ok(())
    }

    /// Marks where a reference contradicts what the filter knew; not those that follow within [`APART_NS`].
    fn contradicted(&mut self, estimate: &estimator::Estimate) {
        let axes = Axis::ALL.into_iter().filter(|axis| estimate.axes[axis.index()].flags & flags::CHANGED != 0);
        let letters: String = axes.map(Axis::letter).collect();
        if letters.is_empty() {
            return;
        }
        let (t_ns, last) =
            (estimate.reference_t_ns, std::mem::replace(&mut self.contradicted_ns, estimate.reference_t_ns));
        if t_ns.saturating_sub(last) > APART_NS {
            let says = format!("the reference contradicts bias or scale ({letters}): both are found again");
            self.scene.mark(Mark { t: t_ns as f64 * 1e-9, epoch: estimate.epoch, says });
        }
    }

    fn parameters(&mut self, pulse: &mut Pulse) -> anyhow::Result<()> {
        let Some(parameters) = self.parameters.newest()?.filter(|p| p.run == self.run) else { return Ok(()) };
        pulse.health.epoch = parameters.epoch;
        if let Some(before) = &self.model {
            for mark in changes(before, &parameters, self.t) {
                self.scene.mark(mark);
            }
        }
        self.scene.now("model", &model::view(&parameters));
        if self.t > 0.0 && now_ns() > self.values_ns + VALUES_NS {
            self.values_ns = now_ns();
            self.scene.learn(model::values(&parameters, self.t));
        }
        self.scene.kept().model = Some(parameters);
        self.model = Some(parameters);
        Ok(())
    }

    fn diagnoses(&mut self) -> anyhow::Result<()> {
        let message = self.diagnoses.newest()?.filter(|d| d.run == self.run);
        self.t = self.t.max(message.map_or(0.0, |m| m.to_ns as f64 * 1e-9));
        if let Some(message) = message.filter(|m| m.changed_ns > self.changed_ns) {
            self.changed_ns = message.changed_ns;
            let (t, epoch) = (self.changed_ns as f64 * 1e-9, message.epoch);
            self.scene.mark(Mark { t, epoch, says: "the error jumps: judged again".to_owned() });
        }
        if let Some(message) = &message {
            let says = |axis: Axis| looking(message, axis.index()).map(|says| (axis.letter(), says));
            let looks: BTreeMap<&str, String> = Axis::ALL.into_iter().filter_map(says).collect();
            self.scene.now("looking", &looks);
        }
        if let Some(message) = &message {
            self.scene.now("trial", &judgement::trial(&message.trial));
        }
        if let Some(diagnosis) = self.reports.newest()?.and_then(|bytes| judgement::of_report(&bytes)) {
            self.has_report = true;
            self.judge(diagnosis);
        } else if let Some(message) = message.filter(|_| !self.has_report) {
            self.judge(judgement::of_message(&message));
        }
        Ok(())
    }

    fn judge(&self, diagnosis: Diagnosis) {
        self.scene.now("page", &judgement::page(&diagnosis));
        for error in judgement::errors(&diagnosis, self.t) {
            self.scene.judge(error);
        }
        self.scene.kept().diagnosis = Some(diagnosis);
    }

    fn health(&mut self) -> anyhow::Result<()> {
        if let Some(status) = self.statuses.newest()?.filter(|s| s.run == self.run) {
            self.scene.now("status", &status_of(&status));
        }
        while let Some(health) = self.healths.take()? {
            if health.run == self.run {
                self.board.take(health);
            }
        }
        if now_ns() > self.stages_ns + STAGES_NS {
            self.stages_ns = now_ns();
            let stages: Vec<Value> = self.board.stages().iter().map(stage_of).collect();
            self.scene.now("stages", &stages);
            self.found();
        }
        Ok(())
    }

    /// What was hidden beside what was found of it, once the model has it.
    fn found(&self) {
        let Some(model) = self.model.as_ref() else { return };
        let source = self.folder.source().unwrap_or_default();
        let hidden: Vec<String> =
            self.hide.iter().chain(source.switched.iter().map(|(_, text)| text)).cloned().collect();
        if hidden.is_empty() {
            return;
        }
        if let Ok(model) = wire::model_of(model, &source.free_names) {
            self.scene.now("found", &story::found(&hidden, &model));
        }
    }

    /// What the source calls itself, once it has said so.
    fn name(&mut self) {
        if !self.named
            && self.sequence > 0
            && let Ok(facts) = self.folder.source()
        {
            self.named = true;
            self.scene.now("source", &json!({ "name": facts.name, "instance": self.instance }));
        }
    }
}

fn status_of(status: &Status) -> Value {
    let services: Vec<Value> = status
        .services
        .iter()
        .filter(|s| !s.name.as_str().is_empty())
        .map(|s| {
            json!({
                "name": s.name.as_str(), "state": s.state.as_str(), "pid": s.pid, "restarts": s.restarts,
                "received": s.received, "sent": s.sent, "lost": s.lost, "rejected": s.rejected, "epoch": s.epoch,
            })
        })
        .collect();
    let learning = status.learning.as_str();
    json!({ "finished": status.finished == 1, "learning": learning, "source": words::json(&status.source), "services": services })
}

/// Quantiles, and counts by octave from the first to the last that has any: the lower edge in ns, the count.
fn stage_of(stage: &Histogram) -> Value {
    let octaves = stage.octaves();
    let first = octaves.iter().position(|o| o.1 > 0).unwrap_or(0);
    let last = octaves.iter().rposition(|o| o.1 > 0).unwrap_or(0);
    json!({
        "stage": stage.stage.as_str(), "count": stage.count, "p50_ns": stage.quantile(0.5), "p99_ns": stage.quantile(0.99),
        "p999_ns": stage.quantile(0.999), "max_ns": stage.max_ns, "octaves": octaves[first..=last],
    })
}

#[cfg(test)]
mod tests {
    use super::stage_of;
    use ipc_types::Histogram;

    #[test]
    fn a_histogram_is_drawn_from_its_first_to_its_last_octave() {
        let mut histogram = Histogram::new("kalman");
        for ns in [1000, 1100, 9000] {
            histogram.record(ns);
        }
        let stage = stage_of(&histogram);
        let octaves = stage["octaves"].as_array().unwrap();
        assert_eq!(octaves.len(), 5, "{octaves:?}");
        assert_eq!(octaves.iter().map(|o| o[1].as_u64().unwrap()).sum::<u64>(), 3);
        assert_eq!(octaves[0][0], 512);
    }
}
