//! acquisition → kalman, compensator: one instant of the sensor and its references.

use crate::MARK_DATA;
use iceoryx2::prelude::ZeroCopySend;

/// Free channels carried beside the named ones.
pub const FREE_CHANNELS: usize = 8;

/// One row of the source, in SI units; `NaN` where there is no value.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[type_name("truerate.Sample.v1")]
pub struct Sample {
    /// The run that this belongs to.
    pub run: u64,
    /// 1 for the source's first good row, one more for each.
    pub sequence: u64,
    /// [`MARK_DATA`] or [`crate::MARK_END`].
    pub mark: u32,
    /// 1 where something was injected into this row, of which no other process takes notice.
    pub injected: u32,
    /// Since the source's first row, ns.
    pub time_ns: i64,
    /// Gyro reading, rad/s.
    pub gyro: [f64; 3],
    /// Reference angle, rad.
    pub ref_angle: [f64; 3],
    /// Reference rate, rad/s.
    pub ref_rate: [f64; 3],
    /// Reference orientation, body to world: w, x, y, z.
    pub ref_quaternion: [f64; 4],
    /// Specific force, m/s².
    pub accel: [f64; 3],
    /// °C.
    pub temperature: f64,
    /// V.
    pub supply: f64,
    /// Free channels; their names are in the run's folder.
    pub free: [f64; FREE_CHANNELS],
    /// When acquisition had the row.
    pub arrived_ns: u64,
    /// When acquisition gave it away.
    pub acquisition_gave_ns: u64,
}

impl Sample {
    /// A sample without a value.
    pub const EMPTY: Self = Self {
        run: 0,
        sequence: 0,
        mark: MARK_DATA,
        injected: 0,
        time_ns: 0,
        gyro: [f64::NAN; 3],
        ref_angle: [f64::NAN; 3],
        ref_rate: [f64::NAN; 3],
        ref_quaternion: [f64::NAN; 4],
        accel: [f64::NAN; 3],
        temperature: f64::NAN,
        supply: f64::NAN,
        free: [f64::NAN; FREE_CHANNELS],
        arrived_ns: 0,
        acquisition_gave_ns: 0,
    };
}

const _: () = assert!(size_of::<Sample>() == 256);
