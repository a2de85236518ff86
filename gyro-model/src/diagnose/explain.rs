//! Why each suspect was named, or was not.

use super::{
    Options,
    challenger::{Challenger, Incumbent},
};
use crate::{
    diagnosis::{Explained, SuspectStage},
    fit::judged::finite,
    scan::Candidate,
};
use itertools::Itertools;

/// Every effect that one axis may lack: those refitted in the order of `suspects`, with each test; then those that the score test
/// left behind, by what it promised of them.
#[must_use]
pub(super) fn explained(
    incumbent: &Incumbent,
    suspects: &[Challenger],
    series: usize,
    options: &Options,
) -> Vec<Explained> {
    let told = |stage: SuspectStage, candidate: &Candidate| Explained {
        effect: candidate.term.effect.card().id.to_owned(),
        stage,
        score: finite(candidate.score),
        promises: finite(candidate.removes),
        tests: Vec::new(),
    };
    let own = suspects.iter().filter(|refit| refit.candidate.series == series);
    let refitted: Vec<Explained> = own
        .map(|refit| {
            let stage = if refit.passes(incumbent) { SuspectStage::Admitted } else { SuspectStage::Refit };
            Explained { tests: refit.explained(incumbent), ..told(stage, &refit.candidate) }
        })
        .collect();
    let is_open = |candidate: &&Candidate| {
        let id = candidate.term.effect.card().id;
        candidate.series == series && !refitted.iter().any(|known| known.effect == id)
    };
    let left = incumbent.scanned(options).iter().filter(is_open);
    let left = left.sorted_by(|a, b| b.score.total_cmp(&a.score)).unique_by(|c| c.term.effect.card().id);
    let left: Vec<Explained> = left.map(|candidate| told(SuspectStage::Scan, candidate)).collect();
    refitted.into_iter().chain(left).collect()
}
