//! kalman → recorder, dashboard, terminal, the vehicle; and acquisition, for which it acknowledges a sample.

use iceoryx2::prelude::ZeroCopySend;

/// [`Estimate::flags`]: the parameters are old, because the compensator is silent.
pub const FLAG_STALE_PARAMETERS: u32 = 1;

/// What is known of one axis at one instant.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.AxisEstimate.v1")]
pub struct AxisEstimate {
    /// 1 where this axis has a reading, or had one.
    pub present: u32,
    /// Flags of the estimator, as `gyro-model` defines them.
    pub flags: u32,
    /// Compensated only, rad/s.
    pub rate: f64,
    /// Compensated and filtered, rad/s.
    pub rate_filtered: f64,
    /// Standard deviation of `rate_filtered`, rad/s.
    pub rate_std: f64,
    /// By how much `rate_filtered` is later than the true rate at the motion's own frequency, s.
    pub lag: f64,
    /// Integral of `rate` alone, rad.
    pub angle: f64,
    /// With the reference, where there is one, rad.
    pub angle_fused: f64,
    /// Residual bias of `rate` as the filter sees it, rad/s.
    pub bias: f64,
    /// Gyro innovation, rad/s.
    pub innovation: f64,
    /// Its predicted standard deviation, rad/s.
    pub innovation_std: f64,
    /// Its square over its variance.
    pub nis: f64,
    /// Innovation of the last reference at this row, rad (rad/s for a rate reference).
    pub reference_innovation: f64,
    /// Its predicted standard deviation.
    pub reference_innovation_std: f64,
}

/// The state after one sample.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[type_name("truerate.Estimate.v3")]
pub struct Estimate {
    /// The run that this belongs to.
    pub run: u64,
    /// The sample's number.
    pub sequence: u64,
    /// [`crate::MARK_DATA`] or [`crate::MARK_END`].
    pub mark: u32,
    /// `FLAG_…`.
    pub flags: u32,
    /// Epoch of the parameters it was made with.
    pub epoch: u64,
    /// The sample's time, ns.
    pub time_ns: i64,
    /// The time at which the rate held, ns (earlier than `time_ns` by the modelled delay).
    pub valid_ns: i64,
    /// The time of a sample whose reference shows that instant, ns: later than `valid_ns` where the reference is late.
    pub reference_ns: i64,
    /// The axes.
    pub axes: [AxisEstimate; 3],
    /// The same on this machine's clock, ns.
    pub valid_clock_ns: u64,
    /// When acquisition had the row.
    pub arrived_ns: u64,
    /// When acquisition gave the sample away.
    pub acquisition_gave_ns: u64,
    /// When kalman took it.
    pub kalman_took_ns: u64,
    /// When kalman gave this.
    pub kalman_gave_ns: u64,
}

const _: () = assert!(size_of::<Estimate>() == 408);
