//! compensator → dashboard, terminal: how far the model is from the floor, and what may be missing.
//!
//! The whole, with every text, is the JSON of topic `report`.

use crate::Text;
use iceoryx2::prelude::ZeroCopySend;

/// Averaging times of an error curve.
pub const TAUS: usize = 32;
/// Suspects that are listed.
pub const SUSPECTS: usize = 5;

/// One averaging time.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.ErrorPoint.v1")]
pub struct ErrorPoint {
    /// s; 0 beyond the last.
    pub tau: f64,
    /// Held out, open loop, rad/s.
    pub error: f64,
    /// Expected where no physics is missing, rad/s.
    pub floor: f64,
    /// Upper end of its 99 % band, rad/s.
    pub floor_99: f64,
}

/// An effect that may be missing.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.Suspect.v1")]
pub struct Suspect {
    /// Effect id; empty beyond the last.
    pub effect: Text<38>,
    /// Effects that look the same on these data, separated by spaces.
    pub aliases: Text<118>,
    /// Share of the excess that adding it removes.
    pub error_fall: f64,
    /// Significance.
    pub p_value: f64,
}

/// One axis.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.AxisResult.v1")]
pub struct AxisResult {
    /// 1 where there is a diagnosis of this axis.
    pub present: u32,
    /// 1 where every error is within its floor's band.
    pub within_floor: u32,
    /// Searches in a row that gave what the last one gave: the same name, or none.
    pub agreed: u32,
    /// 1 where that has settled: enough motion was seen, and enough searches agree.
    pub settled: u32,
    /// As in the JSON.
    pub verdict: Text<30>,
    /// Largest error over floor; `NaN` where there is none.
    pub error_over_floor: f64,
    /// The error curve.
    pub curve: [ErrorPoint; TAUS],
    /// Best first.
    pub suspects: [Suspect; SUSPECTS],
}

/// How a trial stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum TrialState {
    /// There was none yet.
    None = 0,
    /// It goes on: the model in use is still better.
    OnTrial = 1,
    /// The other model won and took over.
    TookOver = 2,
    /// It was not better and is given up, or was undone.
    GivenUp = 3,
}

/// Another model beside the one in use, both refitted to the same samples and judged where neither learned.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.Trial.v1")]
pub struct Trial {
    /// The effect that the other model has more; empty where there was no trial yet.
    pub effect: Text<38>,
    /// [`TrialState`].
    pub state: u32,
    /// 0, 1, 2 for x, y, z.
    pub axis: u32,
    /// Epoch of the model in use when the trial was last decided.
    pub epoch: u64,
    /// Largest error over floor of the model in use.
    pub present: f64,
    /// The same of the other.
    pub other: f64,
    /// Error curve of the model in use.
    pub present_curve: [ErrorPoint; TAUS],
    /// Error curve of the other.
    pub other_curve: [ErrorPoint; TAUS],
}

/// The diagnosis of the recent data, about once a second: the error curve is always new, the suspects are those of the
/// last search of the same model.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.Diagnosis.v1")]
pub struct Diagnosis {
    /// The run.
    pub run: u64,
    /// Grows by one with every diagnosis.
    pub sequence: u64,
    /// Grows by one with every search for suspects.
    pub search: u64,
    /// Epoch of the model that was judged.
    pub epoch: u64,
    /// The data judged, from and to, ns of the source.
    pub from_ns: i64,
    /// See `from_ns`.
    pub to_ns: i64,
    /// When the error last jumped, because the sensor changed, ns of the source; 0 where it never did. What came before is
    /// left out from then on.
    pub changed_ns: i64,
    /// The axes.
    pub axes: [AxisResult; 3],
    /// The last trial.
    pub trial: Trial,
    /// When the work began.
    pub compensator_took_ns: u64,
    /// When this was given.
    pub compensator_gave_ns: u64,
}

const _: () = assert!(size_of::<Suspect>() == 176);
const _: () = assert!(size_of::<Trial>() == 72 + 2 * 32 * TAUS);
const _: () = assert!(size_of::<Diagnosis>() == 72 + 3 * (56 + 32 * TAUS + 176 * SUSPECTS) + size_of::<Trial>());
