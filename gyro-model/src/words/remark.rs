//! What is said beside a finding.

use super::{Argument, Subject, Voice, finding::pieces};
use crate::{
    Axis,
    fault::FaultKind,
    finding::{Became, Finding, NOT_SEEN, Remark},
    measured::and,
    units,
};

/// A remark as a sentence; `None` where there is nothing to say.
pub(super) fn sentence(remark: &Remark, subject: &Subject, voice: Voice) -> Option<String> {
    let log = voice.log();
    Some(match remark {
        Remark::Unexcited(why) => {
            let finding = Finding::CannotTell(why.clone());
            let own = pieces(&Subject { finding: &finding, ..*subject }, voice);
            let says: String = own.into_iter().map(|piece| piece.text + piece.end).collect();
            format!("Besides, {says}.")
        }
        Remark::OwnEffect { effect, became } => own_effect(effect, *became, voice),
        Remark::AtRest => format!(
            "Axis {} does not turn in {log}: only its bias and its noise are judged, and its scale factor stays as it was. To measure the \
             scale factor, turn the axis to and fro through at least a quarter turn for a minute, at several speeds.",
            subject.axis
        ),
        Remark::WrongRatio => {
            let is_own = |fault: &&crate::fault::DataFault| fault.kind == FaultKind::WrongRatio && fault.axis == Some(subject.axis);
            format!("But {}.", subject.faults.iter().find(is_own)?.says)
        }
        Remark::OtherAxis { axis, effect } => format!(
            "But axes of one orientation carry their errors into one another's, and axis {axis} lacks {effect}: add it there first, and \
             look again."
        ),
        Remark::NotSeen { effects } => {
            let (is, them) = if effects.len() == 1 { ("is", "it") } else { ("are", "them") };
            let out = match voice {
                Voice::Log => format!(": `truerate remove` takes {them} out again"),
                Voice::Stream | Voice::Page => String::new(),
                Voice::Library => format!(": `remove` takes {them} out again"),
            };
            format!("On {log} {} {is} less than {NOT_SEEN} standard errors from zero{out}.", effects.join(" and "))
        }
        Remark::JudgedWithout { axes } if axes.contains(&subject.axis) => {
            "The other axes are judged without this one.".to_owned()
        }
        Remark::JudgedWithout { axes } => {
            let them = if axes.len() == 1 { "axis" } else { "axes" };
            let named = axes.iter().map(Axis::to_string).collect::<Vec<_>>().join(" and ");
            format!("Judged without {them} {named}, whose data are faulty.")
        }
        Remark::ReadTheTurn { shares } => {
            let percent = |share: f64| units::number(100.0 * share);
            let own: Vec<String> =
                shares.iter().map(|(axis, share)| format!("gyro_{axis} reads {} %", percent(*share))).collect();
            let them = if own.len() == 1 { "it" } else { "them" };
            let how = match voice {
                Voice::Stream => "record a log: its search fits cross-axis".to_owned(),
                Voice::Log | Voice::Library | Voice::Page => {
                    format!("{} gives {them} a reference of zero, and cross-axis is fitted", Argument::AtRest.name(voice))
                }
            };
            format!(
                "{} of the turn about {}, and there is no reference for {them}. If only axis {} turns, as on a turntable, {how}.",
                and(&own),
                subject.axis,
                subject.axis
            )
        }
        // The headline says it, where the effect is named.
        Remark::EitherSensor { .. } => return None,
        Remark::CoarseTemperature { step, error } => format!(
            "The temperature is logged in steps of {} °C, and within one the zero changes by {} °/s (RMS): log it in finer steps.",
            units::number(*step),
            units::rate(Some(*error))
        ),
        Remark::OtherClock => format!(
            "The clocks of gyro and reference were set to each other by the motion in both, so {log} cannot show a delay between the two."
        ),
        Remark::OwnLog => "The model was fitted on this very log: the errors are those of refits without the part that is judged. A new log \
                           is a better test."
            .to_owned(),
        Remark::Moved { parameter, errors } => {
            let keeps = match voice {
                Voice::Log => ", and `truerate fit` keeps it",
                Voice::Stream | Voice::Page => "",
                Voice::Library => ", and `fit` keeps it",
            };
            format!(
                "But on {log} `{parameter}` is not what the model file says, {errors:.0} standard errors away: what is shown here is \
                 refitted{keeps}."
            )
        }
    })
}

fn own_effect(id: &str, became: Became, voice: Voice) -> String {
    let log = voice.log();
    match became {
        Became::Undefined => format!("Your `{id}` has no finite value anywhere in {log}."),
        Became::PartlyUndefined { share } => {
            format!("Your `{id}` has no finite value in {:.0} % of {log}, and is taken for 0 there.", 100.0 * share)
        }
        Became::Noise => format!("Your `{id}` removes no more than noise does."),
        Became::NothingChanges => format!("Your `{id}` depends on what does not change in {log}, or not enough."),
        Became::Spanned => format!(
            "Your `{id}` is the same as what the model has already: a constant is a bias, the rate a scale factor."
        ),
        Became::RemovesNothing => format!("Your `{id}` removes next to nothing of the error."),
    }
}
