//! Where the noise of a floor is known from, in words.

use super::Voice;
use crate::evidence::prior::{GyroSource, ReferenceSource, Source};

/// Where the noise of gyro and reference comes from.
#[must_use]
pub(crate) fn floor_source(source: &Source, voice: Voice) -> String {
    let log = voice.log();
    let gyro = match source.gyro {
        GyroSource::DataSheet => {
            "the data sheet of a poor MEMS sensor (0.03 °/s/√Hz), because the motion is always jerky".to_owned()
        }
        GyroSource::Unaveraged => "the readings, measured before they were averaged".to_owned(),
        GyroSource::Quietest => "the quietest stretches, because the motion is jerky".to_owned(),
        GyroSource::Smooth => format!("the reading, measured on {log} where the motion is smooth"),
        GyroSource::Reading => format!("the reading, measured on {log}"),
    };
    let rounded = source.rounded.map_or_else(String::new, |step| {
        format!(", too small to average out the reading's steps of {:.3} °/s", step.to_degrees())
    });
    let reference = match source.reference {
        ReferenceSource::Step { step, noisy } => {
            let more = if noisy { " and its noise beyond that step" } else { "" };
            format!("its step of {:.3}°{more}", step.to_degrees())
        }
        ReferenceSource::BesideGyro => format!("the difference of reference and gyro, measured on {log}"),
        ReferenceSource::Own => format!("its own readings, measured on {log}"),
    };
    format!("gyro noise from {gyro}{rounded}; reference noise from {reference}")
}
