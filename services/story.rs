//! The story of a success, in the same words on page and terminal: what an added effect has won.

use crate::wire;
use gyro_model::headline;
use ipc_types::diagnosis::Trial;

/// `Delay added: 0.699 → 0.0723 °/s over 1 s; what is left is noise.`, of a trial that took over.
#[must_use]
pub fn won(trial: &Trial) -> String {
    let (before, after) = (wire::curve_of(&trial.present_curve), wire::curve_of(&trial.other_curve));
    headline::won(trial.effect.as_str(), &before, &after)
}
