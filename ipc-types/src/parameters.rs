//! compensator → kalman, dashboard, terminal: the whole model, or nothing.

use crate::Text;
use iceoryx2::prelude::ZeroCopySend;

/// Effects that one axis can have.
pub const TERMS: usize = 24;
/// Parameters that one effect can have.
pub const VALUES: usize = 8;
/// A user's own effects that a model can define.
pub const DEFINITIONS: usize = 4;

/// One effect with its parameters.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.ParametersTerm.v1")]
pub struct Term {
    /// Id of the effect.
    pub effect: Text<38>,
    /// Parameters in use.
    pub count: u64,
    /// Values in the order of the effect's card, SI.
    pub values: [f64; VALUES],
    /// Their standard errors.
    pub std_errors: [f64; VALUES],
}

/// One axis.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.AxisParameters.v1")]
pub struct AxisParameters {
    /// 1 where the axis is modelled.
    pub present: u32,
    /// Effects in use.
    pub count: u32,
    /// In the order of adding.
    pub terms: [Term; TERMS],
    /// rad/√s.
    pub angle_random_walk: f64,
    /// rad/s/√s.
    pub bias_random_walk: f64,
    /// rad.
    pub encoder: f64,
    /// 1.
    pub unexplained: f64,
}

/// A model with its epoch. Late joiners get the last one; it is published again at about 10 Hz, so that silence means
/// that the compensator is gone.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[type_name("truerate.Parameters.v1")]
pub struct Parameters {
    /// The run that this belongs to.
    pub run: u64,
    /// Grows by one with every change.
    pub epoch: u64,
    /// Samples that it was fitted on; 0 for the model that the run began with.
    pub samples: u64,
    /// 1 while learning is paused, by command or for want of excitation.
    pub paused: u32,
    /// 1 for the solution over the whole run, after its end.
    pub last: u32,
    /// Supply voltage against which ΔV counts, V; `NaN` where there is none.
    pub supply: f64,
    /// The axes.
    pub axes: [AxisParameters; 3],
    /// A user's own effects, each in JSON as the services write it.
    pub definitions: [Text<510>; DEFINITIONS],
    /// When the newest sample that it was fitted on was taken.
    pub compensator_took_ns: u64,
    /// When this epoch was given first.
    pub compensator_gave_ns: u64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            run: 0,
            epoch: 0,
            samples: 0,
            paused: 0,
            last: 0,
            supply: f64::NAN,
            axes: [AxisParameters::default(); 3],
            definitions: [Text::EMPTY; DEFINITIONS],
            compensator_took_ns: 0,
            compensator_gave_ns: 0,
        }
    }
}

const _: () = assert!(size_of::<Term>() == 176);
const _: () = assert!(size_of::<Parameters>() == 14_896);
