//! `truerate effects`: the catalogue, or one card.

use crate::commands::print;
use anyhow::{Result, bail};
use comfy_table::{ContentArrangement, Table, presets};
use gyro_model::{
    Axis,
    effects::{CATALOGUE, Effect, Need, Role, Stage, meant},
    simulate::RandomCauses,
};
use std::{collections::BTreeSet, fmt::Write, process::ExitCode};

/// What `truerate effects` takes.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Examples:
  truerate effects                    the whole catalogue, a line each
  truerate effects g-sensitivity      equation, units, size, source, aliases, how to tell them apart

An effect of your own is a table in the model file. It is then compared, ranked, fitted and run like
any other:

  [effect.load-bias]
  regressor = \"k * load\"
  parameters = { k = { unit = \"rad/s\", typical = 0.01 } }

The regressor is the rate that the gyro reads too high, rad/s. It may use
  rate, rate_dot               compensated rate of the axis, rad/s, and its derivative, rad/s²
  angle, t                     shaft angle, rad; time from the log's first row, s
  gyro_x, gyro_y, gyro_z       compensated rates, rad/s
  accel_x, accel_y, accel_z    specific force, m/s²
  temp, supply                 °C, V
  any other column of the log, + - * / ^, functions such as sin, exp, abs, and pi
and has to be proportional to at least one parameter; the others are shape parameters.
Then: truerate add LOG load-bias --model M")]
pub struct Args {
    /// The effect to show; without it, the whole catalogue
    #[arg(value_name = "ID")]
    pub id: Option<String>,
}

/// Prints the catalogue or one card.
///
/// # Errors
/// An id that the catalogue does not have.
pub fn run(args: &Args) -> Result<ExitCode> {
    match &args.id {
        None => print(&list())?,
        Some(id) => match gyro_model::effects::find(id) {
            Some(effect) => print(&card(effect))?,
            None => bail!("no effect '{id}'{}; `truerate effects` lists them all", meant(id)),
        },
    }
    Ok(ExitCode::SUCCESS)
}

fn list() -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Dynamic);
    for effect in CATALOGUE {
        let card = effect.card();
        table.add_row([card.id, card.title, card.typical]);
    }
    let random: Vec<&str> = RandomCauses::TYPICAL.iter().map(|(_, id, _)| *id).collect();
    format!(
        "{table}\n\n`truerate effects ID` shows the card: equation, units, source, what it is confused with.\n\
         Random causes, which `simulate --hide` makes and the error budget names: {}.\n",
        random.join(", ")
    )
}

fn card(effect: &dyn Effect) -> String {
    let card = effect.card();
    let mut text = format!("{}: {}\n\n{}\n\n", card.id, card.title, card.physics);
    let mut line = |name: &str, value: &str| {
        if !value.is_empty() {
            let _ = writeln!(text, "{name:<11} {value}");
        }
    };
    line("equation", card.equation);
    line("acts on", acts_on(effect.stage()));
    line("typical", card.typical);
    line("needs", &card.needs.iter().map(Need::to_string).collect::<Vec<_>>().join(", "));
    line("shows in", card.excited_by);
    line("correction", card.mended_by);
    line("remedy", card.at_source);
    line("source", card.source);
    text.push_str("\nparameters\n");
    let mut seen = BTreeSet::new();
    for parameter in Axis::ALL.into_iter().flat_map(|axis| effect.parameters(axis)) {
        if seen.insert(parameter.name) {
            let shape = match parameter.role {
                Role::Linear => "",
                Role::Shape => "; a shape parameter",
                Role::Chosen => "; a shape parameter, chosen from a list",
            };
            let (low, high) = parameter.bounds;
            let _ = writeln!(
                text,
                "  {:<9} {:<12} {}; typically {}, within {low} … {high}{shape}",
                parameter.name, parameter.unit, parameter.says, parameter.typical
            );
        }
    }
    if !card.aliases.is_empty() {
        text.push_str("\ncan look like\n");
        for alias in card.aliases {
            let _ = writeln!(text, "  {}: {}; distinguished by: {}", alias.id, alias.when, alias.split_by);
        }
    }
    text
}

fn acts_on(stage: Stage) -> &'static str {
    match stage {
        Stage::Calibration => "the calibration of the reading",
        Stage::Felt => "the rate that the sensor feels",
        Stage::Timing => "the time at which a reading is valid",
        Stage::Response => "the response from the true rate to the rate that the sensor feels",
        Stage::Reading => "the reading itself",
        Stage::Reference => "the reference angle",
        Stage::Shown => "the motion that the reference shows",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_of_the_catalogue_is_listed_and_has_a_card_that_names_its_parameters() {
        let list = list();
        for effect in CATALOGUE {
            assert!(list.contains(effect.card().id));
            let card = card(*effect);
            for parameter in effect.parameters(Axis::X) {
                assert!(card.contains(parameter.unit) && card.contains(parameter.name));
            }
        }
    }
}
