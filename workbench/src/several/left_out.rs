//! Axes of logs that the others are judged without, because their data are at fault.

use super::{Looked, Several};
use crate::subject::Subject;
use gyro_model::{
    Axis,
    diagnosis::{DataFault, Verdict},
};

/// An axis of a log that is left out.
#[derive(Clone, Debug)]
pub(super) struct LeftOut {
    /// The log, and its SHA-256: names may be the same.
    name: String,
    sha256: String,
    /// The axis.
    pub axis: Axis,
    /// Why.
    why: String,
    /// The faults of the log.
    faults: Vec<DataFault>,
}

impl LeftOut {
    fn of(own: &Subject, axis: Axis, why: String, faults: Vec<DataFault>) -> Self {
        Self { name: own.name.clone(), sha256: own.provenance.sha256.clone(), axis, why, faults }
    }

    /// It in a sentence.
    pub fn says(&self) -> String {
        format!("{} is left out: {}.", self.name, self.why.trim_end_matches('.'))
    }

    /// Its faults with the log's name.
    pub fn named_faults(&self) -> impl Iterator<Item = DataFault> {
        let of_axis = self.faults.iter().filter(|fault| fault.axis.is_none_or(|axis| axis == self.axis));
        of_axis.map(|fault| DataFault { says: format!("{}: {}", self.name, fault.says), ..fault.clone() })
    }
}

impl Several {
    /// The axes of logs in which a fault that was found when they were read makes every verdict worthless.
    pub(super) fn faulty(&self) -> Vec<LeftOut> {
        let of = |own: &Subject| {
            let left_out = own.axes.iter().filter_map(|&axis| {
                let concerns = |fault: &&DataFault| fault.axis.is_none_or(|of| of == axis);
                let fault = own.faults.iter().filter(concerns).find(|fault| fault.is_fatal(own.record.len()))?;
                Some(LeftOut::of(own, axis, fault.says.clone(), own.faults.clone()))
            });
            left_out.collect::<Vec<_>>()
        };
        self.subjects.iter().flat_map(of).collect()
    }

    /// The axes of logs that a look at each found to be bad data.
    pub(super) fn bad(&self, looked: &[Looked]) -> Vec<LeftOut> {
        let of = |(own, looked): (&Subject, &Looked)| {
            let bad = looked.diagnosis.axes.iter().filter(|axis| axis.verdict == Verdict::BadData);
            let left_out = bad.map(|axis| {
                let why = axis.data_faults.iter().find(|fault| fault.is_fatal(own.record.len()));
                let why = why.map_or_else(|| axis.headline.clone(), |fault| fault.says.clone());
                LeftOut::of(own, axis.axis, why, axis.data_faults.clone())
            });
            left_out.collect::<Vec<_>>()
        };
        self.judging().zip(looked).flat_map(of).collect()
    }

    /// Leaves these out; whether any log is left to be judged. If none is, all stay.
    pub(super) fn leave_out(&mut self, bad: Vec<LeftOut>) -> bool {
        let mut others = self.subjects.clone();
        for own in &mut others {
            own.axes.retain(|axis| !bad.iter().any(|bad| bad.sha256 == own.provenance.sha256 && bad.axis == *axis));
        }
        others.retain(|own| !Self::judged(own).is_empty());
        if bad.is_empty() || others.is_empty() {
            return false;
        }
        self.axes.retain(|axis| others.iter().any(|own| own.axes.contains(axis)));
        self.subjects = others;
        self.left_out.extend(bad);
        true
    }
}
