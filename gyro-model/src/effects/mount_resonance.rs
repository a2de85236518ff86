//! `mount-resonance`: a springy plate between shaft and gyro, a second-order response.

use super::{
    Acts, Alias, Card, Effect, Lately, Memory, ParameterCard, Response, Role, Span, Trait, low_pass, low_passed,
    second_derivative, slowed,
};
use crate::Axis;
use crate::measured::Measured;
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// The effect.
pub static MOUNT_RESONANCE: MountResonance = MountResonance;

/// See the file's head.
pub struct MountResonance;

static CARD: Card = Card {
    id: "mount-resonance",
    title: "the mount is springy and rings at its own frequency",
    physics: "Tape, foam or a thin plate between shaft and gyro is a damped spring: motion is amplified up to the \
             resonance and attenuated above it.",
    equation: "ω_f = ω through (2ζω_n s + ω_n²)/(s² + 2ζω_n s + ω_n²), ω_n = 2πf",
    typical: "f 5–300 Hz, ζ 0.02–0.3",
    source: "base-excited oscillator (transmissibility), any text on vibration",
    needs: &[],
    excited_by: "motion at frequencies up to f",
    mended_by: "the inverse D = ω − ω_f, 2ζω_n D' + ω_n² D = ω_f'', which amplifies noise above f",
    at_source: "mount the sensor stiffly: screws in place of tape or foam, a thicker plate",
    traits: &[Trait::Resonance],
    simpler: &["lag"],
    aliases: &[
        Alias {
            id: "reference-smoothing",
            when: "the motion stays far below the resonance: both raise the gyro's rate with the square of the frequency",
            split_by: "motion up to the resonance; or the filter settings of the reference",
        },
        Alias {
            id: "reference-lag",
            when: "beside a delay, where the motion stays far below the resonance",
            split_by: "motion up to the resonance; or the filter settings of the reference",
        },
        Alias {
            id: "cubic-nonlinearity",
            when: "the motion is fast only where it is large",
            split_by: "a slower and a faster motion of the same amplitude",
        },
    ],
};

static PARAMETERS: [ParameterCard; 2] = [
    ParameterCard {
        name: "f",
        unit: "Hz",
        says: "undamped resonance",
        role: Role::Shape,
        neutral: f64::INFINITY,
        typical: 12.0,
        bounds: (1.0, f64::INFINITY),
    },
    ParameterCard {
        name: "zeta",
        unit: "1",
        says: "damping ratio",
        role: Role::Shape,
        neutral: 0.1,
        typical: 0.1,
        bounds: (0.005, 0.95),
    },
];

/// What compensation does, in C.
const IN_C: &str = "\
const double omega = 6.283185307179586 * f, f1 = memory[0], f2 = memory[1], dt1 = memory[2];
const double curvature = memory[6] < 2.0 ? 0.0 : 2.0 * ((felt - f1) / dt - (f1 - f2) / dt1) / (dt + dt1);
const double input = curvature / (omega * omega), lasts = 2.0 * zeta / omega;
double difference = input;
if (memory[6] > 2.0) {
    difference = memory[3];
    if (dt > 0.0) {
        const double a = dt / lasts, rise = -expm1(-a);
        difference = memory[3] + (memory[4] - memory[3]) * rise + (input - memory[4]) * (1.0 - rise / a);
    }
}
memory[0] = felt;
memory[1] = f1;
memory[2] = dt;
memory[3] = difference;
memory[4] = input;
memory[6] = fmin(memory[6] + 1.0, 3.0);
return felt + difference;";

impl Effect for MountResonance {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn acts(&self) -> Acts<'_> {
        Acts::Response(self)
    }

    fn parameters(&self, _: Axis) -> &'static [ParameterCard] {
        &PARAMETERS
    }

    fn says(&self, _: Axis, p: &[Measured]) -> String {
        format!("your gyro swings on its mount at {}, with a damping ratio of {}", p[0].signed("Hz"), p[1].plain())
    }

    fn in_c(&self, _: Axis) -> Option<Cow<'static, str>> {
        Some(IN_C.into())
    }

    fn grid(&self, span: &Span) -> Vec<Vec<f64>> {
        let end = (1.0 / span.dt).min(300.0);
        let frequencies = std::iter::successors(Some(3.0), |f| Some(f * 1.5)).take_while(|&f| f <= end);
        frequencies.flat_map(|f| [0.03, 0.1, 0.3].map(|zeta| vec![f, zeta])).collect()
    }
}

impl Response for MountResonance {
    /// Exact for a rate that is linear over the step: e = ω − ω_f swings freely, e'' + 2ζω_n e' + ω_n² e = 0, and e'
    /// jumps where the slope of ω does.
    fn respond(&self, p: &[f64], rate: f64, dt: f64, memory: &mut Memory) -> f64 {
        let swing = memory.of::<Swing>();
        if swing.started == 0.0 || !p[0].is_finite() || dt <= 0.0 {
            *swing = Swing { e: 0.0, e_dot: 0.0, rate, slope: 0.0, started: 1.0 };
            return rate;
        }
        let (omega, zeta) = (std::f64::consts::TAU * p[0], p[1]);
        let slope = (rate - swing.rate) / dt;
        let (e, e_dot) = (swing.e, swing.e_dot + slope - swing.slope);
        let (decay, damped) = (zeta * omega, omega * (1.0 - zeta * zeta).sqrt());
        let (sin, cos) = (damped * dt).sin_cos();
        let fall = (-decay * dt).exp();
        swing.e = fall * (e * cos + (e_dot + decay * e) / damped * sin);
        swing.e_dot = fall * (e_dot * cos - (decay * e_dot + omega * omega * e) / damped * sin);
        (swing.rate, swing.slope) = (rate, slope);
        rate - swing.e
    }

    /// D = ω − ω_f is ω_f''/ω_n² through a first-order low-pass of time constant 2ζ/ω_n, exact for an input that is
    /// linear over the step; ω_f'' from the last three samples.
    fn undo_response(&self, p: &[f64], felt: f64, dt: f64, memory: &mut Memory) -> f64 {
        let past = memory.of::<Past>();
        let ([f1, f2], dt1, samples) = (past.lately.felt, past.lately.dt, past.lately.samples);
        let curvature = if samples < 2.0 { 0.0 } else { 2.0 * ((felt - f1) / dt - (f1 - f2) / dt1) / (dt + dt1) };
        let omega = std::f64::consts::TAU * p[0];
        let input = curvature / (omega * omega);
        // The first curvature is the best guess of what came before it.
        let settled = samples > 2.0;
        let difference =
            if settled { low_pass(past.difference, past.input, input, dt, 2.0 * p[1] / omega) } else { input };
        (past.difference, past.input) = (difference, input);
        past.lately.take(felt, dt);
        felt + difference
    }

    /// The same. What is much faster than the mount swings it does not pass on, and the noise there would be made so large that a
    /// fit would look for the damping which makes least of it.
    fn undo_response_whole(&self, p: &[f64], t: &[f64], felt: &[f64]) -> Vec<f64> {
        let omega = std::f64::consts::TAU * p[0];
        let curvature = second_derivative(t, &slowed(t, felt, SWIFT / omega));
        let input: Vec<f64> = curvature.iter().map(|c| c / (omega * omega)).collect();
        low_passed(t, &input, 2.0 * p[1] / omega).iter().zip(felt).map(|(difference, felt)| felt + difference).collect()
    }

    fn reach(&self, p: &[f64]) -> f64 {
        // Three time constants of the low-pass.
        6.0 * p[1] / (std::f64::consts::TAU * p[0])
    }
}

/// Of a swing's 1/(2πf), half the width of the window that what it passes on is told from noise by: what is twice as fast stays
/// to 2e-3, what is seven times as fast goes.
const SWIFT: f64 = 0.7;
/// What the mount remembers.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Swing {
    /// e = ω − ω_f and its derivative.
    e: f64,
    e_dot: f64,
    /// The last rate and its slope.
    rate: f64,
    slope: f64,
    /// 1 after the first sample.
    started: f64,
}

/// What its inverse remembers.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Past {
    lately: Lately,
    /// D and its input.
    difference: f64,
    input: f64,
}
