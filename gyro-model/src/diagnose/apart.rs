//! Axes whose own data are faulty, apart from those whose data are good.
//!
//! One orientation, or what an axis sees of the others, joins axes to one fit: a gyro that is wired the wrong way round would
//! spoil them all. So those that are good are judged without it, and it by itself.

use crate::{
    Axis, Model, Record,
    diagnosis::{AxisResult, DataFault},
    finding::Remark,
    fit::FitError,
};

/// Axes of one log that are judged apart.
pub(super) struct Parts<'a> {
    record: &'a Record,
    /// The log without the gyros of the bad axes.
    without: Record,
    good: Vec<Axis>,
    bad: Vec<Axis>,
}

/// `None` where all axes are good, or none is.
pub(super) fn parts<'a>(record: &'a Record, axes: &[Axis], faults: &[DataFault]) -> Option<Parts<'a>> {
    let is_bad = |axis: &Axis| faults.iter().any(|f| f.axis == Some(*axis) && f.is_fatal(record.len()));
    let (bad, good): (Vec<Axis>, Vec<Axis>) = axes.iter().copied().partition(is_bad);
    if bad.is_empty() || good.is_empty() {
        return None;
    }
    let mut without = record.clone();
    for row in &mut without.rows {
        for axis in &bad {
            row.gyro[axis.index()] = f64::NAN;
        }
    }
    Some(Parts { record, without, good, bad })
}

impl Parts<'_> {
    /// Diagnoses each part.
    pub(super) fn each(
        &self,
        judge: impl Fn(&Record, &[Axis]) -> Result<Vec<AxisResult>, FitError>,
    ) -> Result<Vec<AxisResult>, FitError> {
        let mut all = judge(&self.without, &self.good)?;
        all.extend(judge(self.record, &self.bad)?);
        for own in &mut all {
            own.remarks.push(Remark::JudgedWithout { axes: self.bad.clone() });
        }
        all.sort_by_key(|own| own.axis);
        Ok(all)
    }

    /// Climbs each part's ladder from `start`.
    pub(super) fn ladders(
        &self,
        start: &Model,
        climb: impl Fn(&Record, &[Axis]) -> Result<(Model, Vec<AxisResult>), FitError>,
    ) -> Result<(Model, Vec<AxisResult>), FitError> {
        let (mut model, mut all) = climb(&self.without, &self.good)?;
        let (of_bad, ladders) = climb(self.record, &self.bad)?;
        for axis in &self.bad {
            model.axes[axis.index()].clone_from(&of_bad.axes[axis.index()]);
        }
        model.epoch = start.epoch + 1;
        all.extend(ladders);
        for own in &mut all {
            own.remarks.push(Remark::JudgedWithout { axes: self.bad.clone() });
        }
        all.sort_by_key(|own| own.axis);
        Ok((model, all))
    }
}
