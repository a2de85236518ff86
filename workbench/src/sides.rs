//! Two sensors side by side, each with a log of its own.

use crate::{
    report::BothSides,
    subject::{Start, Subject},
};
use anyhow::{Result, bail};
use gyro_model::{
    Axis,
    diagnosis::Diagnosis,
    headline::sides::{Side, Sides},
};

/// A log, the model that is held against it, and what that came to.
#[derive(Debug)]
pub struct Judged {
    /// The log, with the axes that were judged.
    pub subject: Subject,
    /// The model.
    pub start: Start,
    /// What it came to.
    pub diagnosis: Diagnosis,
}

/// Sets two of them beside each other, under these names.
///
/// # Errors
/// They are one log, or have no axis in common.
pub fn beside(own: [Judged; 2], names: [String; 2]) -> Result<BothSides> {
    if own[0].subject.provenance.sha256 == own[1].subject.provenance.sha256 {
        bail!("{} and {} are the same log: give one log of each sensor", own[0].subject.name, own[1].subject.name);
    }
    let side = |k: usize, axis: Axis| {
        let Judged { subject, diagnosis, .. } = &own[k];
        let found = diagnosis.axes.iter().find(|own| own.axis == axis)?;
        let (seconds, samples) = (subject.record.duration(), subject.provenance.samples);
        Some(Side { name: &names[k], axis: found, seconds, samples })
    };
    let pairs = Axis::ALL.into_iter().filter_map(|axis| Some((side(0, axis)?, side(1, axis)?)));
    let sides: Vec<Sides> = pairs.map(|(first, second)| Sides::of(&first, &second)).collect();
    if sides.is_empty() {
        let has = |k: usize| own[k].diagnosis.axes.iter().map(|own| own.axis.letter()).collect::<Vec<_>>().join(", ");
        bail!("the logs have no axis in common: {} has {}, {} has {}", names[0], has(0), names[1], has(1));
    }
    Ok(BothSides { names, diagnoses: own.map(|own| own.diagnosis), sides })
}
