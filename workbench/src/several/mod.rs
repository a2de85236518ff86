//! Several logs of one sensor: one model for all, a zero and a reference for each.
//!
//! Each log is diagnosed by itself with the engine of one log. Then it is reduced to its normal equations at what was found
//! ([`gyro_model::pooled`]), these are added up, and what they show together is the answer: what repeats is the sensor's, what does not is
//! the set-up's.

mod left_out;
mod own_maps;
mod pool;
mod says;
mod shared;

use crate::{
    log,
    model_file::ModelFile,
    subject::{Start, Subject, Taken},
};
use anyhow::{Context, Result, bail};
use gyro_model::{
    Axis, Model, Record, Term, diagnose,
    diagnosis::{AxisResult, DIAGNOSIS, Diagnosis, LADDER, LadderStep, Repeats, Several as Shared, Verdict},
    effects::find,
    pooled::{
        self, Piece,
        column::is_own,
        joint::{self, Joint},
        search::{Repeated, Whose},
    },
};
use left_out::LeftOut;
pub use own_maps::{Unfit, read as read_each};
use sha2::{Digest, Sha256};
use shared::{Found, OtherScale, axes_of, scale_of};
use std::path::{Path, PathBuf};

/// Logs of one sensor that have been read.
#[derive(Clone, Debug)]
pub struct Several {
    /// Each log.
    pub subjects: Vec<Subject>,
    /// The axes that any of them has.
    pub axes: Vec<Axis>,
    /// Maps that were not taken of every log.
    pub unfit: Vec<Unfit>,
    /// Axes of logs whose data are at fault, which the others are judged without.
    left_out: Vec<LeftOut>,
}

/// One log, looked at.
#[derive(Clone, Debug)]
pub struct Looked {
    /// What it alone comes to.
    pub diagnosis: Diagnosis,
    /// The model at which it is linearised: the model that was held against it with what it alone names, fitted to it.
    pub point: Model,
    /// The axes that it can judge.
    pub axes: Vec<Axis>,
    /// Its normal equations.
    pub pieces: Vec<Piece>,
}

/// Looks at one log: diagnoses it, and reduces it to its normal equations at what was found.
///
/// # Errors
/// A log that cannot be judged.
pub fn look(subject: &Subject, start: &Start, options: &diagnose::Options) -> Result<Looked> {
    let options = diagnose::Options { faults: &subject.faults, ..*options };
    let diagnosis = subject.diagnose(start, &options)?;
    let mut point = start.file.model.clone();
    let judged = |axis: &AxisResult| axis.verdict != Verdict::BadData && !subject.overruled.contains(&axis.axis);
    let axes: Vec<Axis> = diagnosis.axes.iter().filter(|axis| judged(axis)).map(|axis| axis.axis).collect();
    for axis in diagnosis.axes.iter().filter(|axis| axis.finding.names()) {
        let Some(own) = &mut point.axes[axis.axis.index()] else { continue };
        let several = axis.suspects.len().min(axis.missing.len().max(1));
        for suspect in &axis.suspects[..several] {
            let Some(effect) = find(&suspect.effect).filter(|_| own.term(&suspect.effect).is_none()) else { continue };
            let mut term = Term::neutral(effect, axis.axis);
            for (value, card) in term.values.iter_mut().zip(effect.parameters(axis.axis)) {
                let told = suspect.parameters.iter().find(|p| p.name == card.name).and_then(|p| p.value);
                *value = told.unwrap_or(*value);
            }
            own.terms.push(term);
        }
    }
    if axes.is_empty() {
        return Ok(Looked { diagnosis, point, axes, pieces: Vec::new() });
    }
    let only = Subject { axes: axes.clone(), ..subject.clone() };
    let point = only.fit(&point)?;
    let pieces = pooled::pieces(&subject.record, &point, &axes, seed(&subject.provenance.sha256))
        .with_context(|| subject.name.clone())?;
    let pieces = pieces.into_iter().filter(Piece::is_whole).collect();
    Ok(Looked { diagnosis, point, axes, pieces })
}

/// Draws of noise of a log's own: those of its bytes.
fn seed(sha256: &str) -> u64 {
    let digest = Sha256::digest(sha256.as_bytes());
    u64::from_le_bytes(std::array::from_fn(|k| digest[k]))
}

impl Several {
    /// Reads logs for fitting.
    ///
    /// # Errors
    /// A refused log, one that is given twice, an axis that none of them has.
    pub fn read(paths: &[PathBuf], taken: &Taken, progress: impl FnMut(&Path)) -> Result<Self> {
        let any = Taken { axis: None, ..taken.clone() };
        let (mut subjects, unfit) = own_maps::read(paths, &any, progress)?;
        if let Some(axis) = taken.axis {
            for subject in &mut subjects {
                subject.axes.retain(|own| *own == axis);
            }
        }
        if let Some(axis) = taken.axis.filter(|_| subjects.iter().all(|own| own.axes.is_empty())) {
            bail!("none of the {} logs has a gyro and a reference of axis {axis}", subjects.len());
        }
        Ok(Self { unfit, ..Self::of(subjects)? })
    }

    /// Of logs that have been read.
    ///
    /// # Errors
    /// A log that is given twice, or no axis at all.
    pub fn of(mut subjects: Vec<Subject>) -> Result<Self> {
        for (k, own) in subjects.iter().enumerate() {
            if let Some(same) = subjects[..k].iter().find(|one| one.provenance.sha256 == own.provenance.sha256) {
                bail!("{}: is the same log as {}: leave it out, or it would count twice", own.name, same.name);
            }
        }
        let axes: Vec<Axis> =
            Axis::ALL.into_iter().filter(|axis| subjects.iter().any(|own| own.axes.contains(axis))).collect();
        if axes.is_empty() {
            bail!("none of the {} logs has a gyro and a reference of any axis", subjects.len());
        }
        subjects.retain(|own| !own.axes.is_empty());
        let mut several = Self { subjects, axes, unfit: Vec::new(), left_out: Vec::new() };
        several.leave_out(several.faulty());
        Ok(several)
    }

    /// The logs' names.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.subjects.iter().map(|own| own.name.clone()).collect()
    }

    /// All of them in a few words.
    #[must_use]
    pub fn name(&self) -> String {
        let short = |own: &Subject| own.provenance.log.clone();
        match &self.subjects[..] {
            [one] => one.name.clone(),
            all if all.len() <= 3 => all.iter().map(short).collect::<Vec<_>>().join(" + "),
            all => format!("{} + {} more", short(&all[0]), all.len() - 1),
        }
    }

    /// What the logs are, in a few words each.
    #[must_use]
    pub fn about(&self, model: Option<&Path>) -> Vec<String> {
        let seconds: f64 = self.subjects.iter().map(|own| own.record.duration()).sum();
        let rows: u64 = self.subjects.iter().map(|own| own.provenance.samples).sum();
        let mut about = vec![
            format!("{} logs of one sensor", self.subjects.len()),
            format!("{seconds:.0} s together"),
            format!("{} rows", crate::report::units::thousands(rows)),
        ];
        let temperatures = || self.subjects.iter().filter_map(|own| own.provenance.temperature);
        if let Some(range) = temperatures().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) {
            about.push(format!("{:.1} to {:.1} °C", range.0, range.1));
        }
        about.push(match model.and_then(Path::file_name) {
            Some(name) => format!("model: {}", name.to_string_lossy()),
            None => "model at the start: scale factor and bias".to_owned(),
        });
        about
    }

    /// A model with these logs as its provenance.
    #[must_use]
    pub fn fitted(&self, model: Model, start: &ModelFile) -> ModelFile {
        let all = self.subjects.iter().map(|own| &own.provenance);
        let temperatures = all.clone().filter_map(|own| own.temperature);
        let digest =
            Sha256::digest(all.clone().map(|own| own.sha256.as_str()).collect::<Vec<_>>().join("+").as_bytes());
        let provenance = log::Provenance {
            log: self.name(),
            sha256: hexadecimal(&digest),
            samples: all.map(|own| own.samples).sum(),
            temperature: temperatures.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))),
            ..log::Provenance::default()
        };
        let provenance = Some(crate::model_file::Provenance::now(&provenance));
        ModelFile { model, provenance, own_effects: start.own_effects.clone() }
    }

    /// The model to start from: that of this file, or the base model, not fitted yet.
    ///
    /// # Errors
    /// A model that cannot be read, or that goes by a channel that a log lacks.
    pub fn start(&self, model: Option<&Path>) -> Result<Start> {
        let names = self.subjects.first().map_or(&[][..], |own| &own.record.free_names);
        self.start_with(model.map(|path| crate::model_file::load(path, names)).transpose()?)
    }

    /// The same with a model that has been read.
    ///
    /// # Errors
    /// A model that goes by a channel that a log lacks.
    pub fn start_with(&self, model: Option<ModelFile>) -> Result<Start> {
        let given = model.is_some();
        let file = model.unwrap_or_else(|| ModelFile { model: self.base(), ..ModelFile::default() });
        for own in &self.subjects {
            file.check_channels(&own.record, &own.axes).with_context(|| own.name.clone())?;
        }
        Ok(Start { file, own_log: false, given, laid: None })
    }

    fn base(&self) -> Model {
        let mut model = Model::default();
        for own in &self.subjects {
            let base = own.base();
            for axis in &own.axes {
                if model.axes[axis.index()].is_none() {
                    model.axes[axis.index()].clone_from(&base.axes[axis.index()]);
                }
            }
            model.origin.supply = model.origin.supply.or(base.origin.supply);
        }
        model
    }

    /// Fits one model to all logs; each starts from its own fit.
    ///
    /// # Errors
    /// A log that cannot be fitted.
    pub fn fit(&self, model: &Model, progress: &(dyn Fn(&str) + Sync)) -> Result<Joint> {
        self.fit_beside(model, &[], &[], &[], progress)
    }

    /// The same where each log has more that is its own: what it alone named, the size of what differs, and on the axes `apart` the scale
    /// factor.
    fn fit_beside(
        &self,
        model: &Model,
        looked: &[Looked],
        repeated: &[Repeated],
        apart: &[Axis],
        progress: &(dyn Fn(&str) + Sync),
    ) -> Result<Joint> {
        let mut logs: Vec<(&Record, Model, Vec<Axis>)> = Vec::new();
        for own in &self.subjects {
            let axes = Self::judged(own);
            if axes.is_empty() {
                continue;
            }
            progress(&own.name);
            let subject = Subject { axes: axes.clone(), ..own.clone() };
            let start = looked.get(logs.len()).map_or_else(|| model.clone(), |looked| with_own(model, &looked.point));
            logs.push((&own.record, subject.fit(&start)?, axes));
        }
        if logs.is_empty() {
            bail!("none of the {} logs has a reference that is a measurement of its own", self.subjects.len());
        }
        progress("all logs");
        let differing = repeated.iter().filter(|r| r.differs()).map(|r| (r.axis, r.effect.clone()));
        let differing: Vec<(Axis, String)> =
            differing.chain(apart.iter().map(|axis| (*axis, scale_of(*axis).effect))).collect();
        let mut joint = joint::fit(&logs, &differing).with_context(|| self.name())?;
        joint.model.epoch = model.epoch + 1;
        joint.model.origin = model.origin;
        Ok(joint)
    }

    /// The axes of a log whose reference is one.
    fn judged(own: &Subject) -> Vec<Axis> {
        own.axes.iter().filter(|axis| !own.overruled.contains(axis)).copied().collect()
    }

    /// The logs that have an axis to be judged on.
    fn judging(&self) -> impl Iterator<Item = &Subject> {
        self.subjects.iter().filter(|own| !Self::judged(own).is_empty())
    }

    /// Each log held against its own model, or all against one, whose parameters stand.
    ///
    /// # Errors
    /// A log that cannot be judged.
    fn held(&self, models: &dyn Fn(usize) -> Model, options: &diagnose::Options) -> Result<Vec<Diagnosis>> {
        let one = |(k, own): (usize, &Subject)| {
            (options.progress)(&own.name);
            let options = diagnose::Options { own_log: false, faults: &own.faults, ..*options };
            let model = models(k);
            let axes: Vec<Axis> = Self::judged(own).into_iter().filter(|a| model.axes[a.index()].is_some()).collect();
            own.compare(&model, &axes, &options)
        };
        self.judging().enumerate().map(one).collect()
    }

    /// Fits a model to all logs and holds it against each.
    ///
    /// # Errors
    /// A log that cannot be fitted or judged.
    pub fn fit_and_compare(&self, start: &Model, options: &diagnose::Options) -> Result<(Joint, Diagnosis)> {
        let hold = |joint: &Joint| self.held(&|k| joint.each[k].model.clone(), options);
        let mut joint = self.fit(start, options.progress)?;
        let mut held = hold(&joint)?;
        let mut other = self.of_other_scale(&joint, |k, key| joint.each[k].alone.get(key).copied());
        if !other.is_empty() {
            let own = self.fit_beside(start, &[], &[], &axes_of(&other), options.progress)?;
            let held_own = hold(&own)?;
            // An effect that the model lacks may look like it: then more than noise is left.
            let is_noise = |of: &OtherScale| {
                let mut axes = held_own.iter().flat_map(|log| &log.axes).filter(|axis| axis.axis == of.key.axis);
                axes.all(|axis| axis.within_floor == Some(true))
            };
            if other.iter().all(is_noise) {
                (joint, held) = (own, held_own);
            } else {
                other.clear();
            }
        }
        let mut diagnosis = self.pooled(&held, Some(&joint), &held, &[]);
        self.tell(&mut diagnosis, self.scales(&other));
        Ok((joint, diagnosis))
    }

    /// Holds a model against all logs: one that is given stands as it is, the base model is fitted to all.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn compare(&self, start: &Start, options: &diagnose::Options) -> Result<Diagnosis> {
        if !start.given {
            return Ok(self.fit_and_compare(&start.file.model, options)?.1);
        }
        let held = self.held(&|_| start.file.model.clone(), options)?;
        Ok(self.pooled(&held, None, &held, &[]))
    }

    /// Looks at every log by itself.
    ///
    /// # Errors
    /// A log that cannot be judged.
    fn looked(&self, start: &Start, options: &diagnose::Options) -> Result<Vec<Looked>> {
        let one = |own: &Subject| {
            (options.progress)(&own.name);
            let only = Subject { axes: Self::judged(own), ..own.clone() };
            look(&only, start, options)
        };
        self.judging().map(one).collect()
    }

    /// Says which effect the model is missing that all logs share, and what else some of them show.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn diagnose(&self, start: &Start, options: &diagnose::Options) -> Result<Diagnosis> {
        Ok(self.answered(start, options)?.diagnosis)
    }

    fn answered(&self, start: &Start, options: &diagnose::Options) -> Result<Answered> {
        let looked = self.looked(start, options)?;
        let bad = self.bad(&looked);
        if !bad.is_empty() {
            let mut others = self.clone();
            if others.leave_out(bad) {
                return others.answered(start, options);
            }
        }
        let mut found = self.shared(start, &looked, &[], options)?;
        // As each log says it beside what it alone has.
        let other = self.of_other_scale(&found.joint, |k, key| looked[k].told(key));
        if !other.is_empty() {
            found = self.shared(start, &looked, &axes_of(&other), options)?;
        }
        let scales = self.scales(&other);
        let Found { repeated, joint } = found;
        let alone: Vec<Diagnosis> = looked.iter().map(|own| own.diagnosis.clone()).collect();
        let held = self.held(&|k| joint.each[k].model.clone(), options)?;
        let names_any = repeated.iter().any(|r| r.whose == Whose::Sensor);
        // What is missing shows in the logs as each has the model: fitted to it alone.
        let mut diagnosis = self.pooled(if names_any { &alone } else { &held }, Some(&joint), &alone, &repeated);
        let end = self.pooled(&held, Some(&joint), &held, &repeated);
        let names: Vec<String> = self.judging().map(|own| own.provenance.log.clone()).collect();
        pool::judge(&mut diagnosis.axes, &alone, &repeated, &end.axes);
        let mut repeats = says::repeats(&names, &alone, &repeated, &joint, &diagnosis.axes);
        repeats.extend(scales);
        for axis in diagnosis.axes.iter_mut().filter(|axis| repeats.iter().all(|own| own.axis != axis.axis)) {
            axis.of_logs = says::over_all(names.len());
        }
        if let Some(several) = &mut diagnosis.several {
            several.each = end.several.map_or_else(Vec::new, |own| own.each);
        }
        self.tell(&mut diagnosis, repeats);
        Ok(Answered { diagnosis, joint, end: end.axes })
    }

    /// What is said of scale factors that are not the same in the logs.
    fn scales(&self, other: &[OtherScale]) -> Vec<Repeats> {
        let names: Vec<String> = self.judging().map(|own| own.provenance.log.clone()).collect();
        other.iter().map(|own| says::scales(&names, own)).collect()
    }

    /// Tells with each axis what repeats, and which logs it was judged without.
    fn tell(&self, diagnosis: &mut Diagnosis, repeats: Vec<Repeats>) {
        for axis in &mut diagnosis.axes {
            let repeats = repeats.iter().filter(|own| own.axis == axis.axis).map(|own| own.says.clone());
            let left_out = self.left_out.iter().filter(|own| own.axis == axis.axis);
            for says in repeats.chain(left_out.clone().map(LeftOut::says)) {
                if !axis.of_logs.contains(&says) {
                    format!("{} {says}", axis.of_logs).trim().clone_into(&mut axis.of_logs);
                }
            }
            axis.data_faults.extend(left_out.flat_map(LeftOut::named_faults));
        }
        if let Some(several) = &mut diagnosis.several {
            several.repeats = repeats;
        }
    }

    /// Adds what all logs show together; the model, and what each step comes to.
    ///
    /// # Errors
    /// A log that cannot be judged.
    pub fn ladder(&self, start: &Start, options: &diagnose::Options) -> Result<(ModelFile, Diagnosis)> {
        let Answered { diagnosis, joint, end } = self.answered(start, options)?;
        let mut axes = Vec::new();
        for (found, end) in diagnosis.axes.into_iter().zip(end) {
            let step = |added: Option<&String>, aliases: &[String], axis: &AxisResult| LadderStep {
                added: added.cloned(),
                removed: None,
                aliases: aliases.to_vec(),
                error_curve: axis.error_curve.clone(),
                error_over_floor: axis.error_over_floor,
            };
            let mut steps = vec![step(None, &[], &found)];
            let named: Vec<_> = found.suspects.iter().filter(|s| end.effects.contains(&s.effect)).collect();
            for (k, suspect) in named.iter().enumerate() {
                // All of them are fitted at once: what one alone leaves is not known before the last.
                let reached = if k + 1 == named.len() { &end } else { &found };
                steps.push(step(Some(&suspect.effect), &suspect.aliases, reached));
            }
            axes.push(pool::at_the_top(&found, end, steps));
        }
        let file = self.fitted(joint.model, &start.file);
        let ladder = Diagnosis { schema: LADDER.to_owned(), log: self.name(), axes, several: diagnosis.several };
        Ok((file, ladder))
    }

    /// The result of all logs: `held` under the common model, `alone` what each comes to by itself.
    fn pooled(
        &self,
        held: &[Diagnosis],
        joint: Option<&Joint>,
        alone: &[Diagnosis],
        repeated: &[Repeated],
    ) -> Diagnosis {
        let seconds: Vec<f64> = self.judging().map(|own| own.record.duration()).collect();
        let names: Vec<String> = self.judging().map(|own| own.name.clone()).collect();
        let axes =
            self.axes.iter().filter_map(|axis| pool::axis(*axis, held, alone, &seconds, &names, joint)).collect();
        let each = pool::each(held, alone, &names, joint, repeated);
        let several = Some(Shared { logs: self.names(), each, repeats: Vec::new() });
        Diagnosis { schema: DIAGNOSIS.to_owned(), log: self.name(), axes, several }
    }
}

/// A model with what one log alone has of its own: a step of its zero, its reference.
fn with_own(model: &Model, point: &Model) -> Model {
    let mut model = model.clone();
    for (own, point) in model.axes.iter_mut().zip(&point.axes) {
        let (Some(own), Some(point)) = (own, point) else { continue };
        let new = point.terms.iter().filter(|term| is_own(term.effect) && own.term(term.effect.card().id).is_none());
        let new: Vec<Term> = new.cloned().collect();
        own.terms.extend(new);
    }
    model
}

/// What a search over several logs found.
struct Answered {
    diagnosis: Diagnosis,
    /// The model with all that they share.
    joint: Joint,
    /// What it comes to.
    end: Vec<AxisResult>,
}

/// Bytes as two digits each.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    let digit = |value: u8| char::from(b"0123456789abcdef"[usize::from(value & 15)]);
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(*byte)]).collect()
}
