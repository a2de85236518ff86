//! What can be taken home: the model, a report, the last minutes as a log.

use super::{scene::Scene, server::Download};
use crate::{run_folder::RunFolder, wire};
use gyro_model::diagnosis::Diagnosis;
use workbench::{
    log,
    model_file::{self, ModelFile, Provenance},
    report::{self, Command, Context, Format},
};

/// Makes the download of this name.
pub(super) fn export(scene: &Scene, folder: &RunFolder, name: &str) -> Download {
    match name {
        "model.toml" => model(scene, folder),
        "report.html" => page(scene, folder),
        "log.csv" => log(scene, folder),
        _ => Err("there is model.toml, report.html and log.csv".into()),
    }
}

fn model(scene: &Scene, folder: &RunFolder) -> Download {
    let parameters = scene.kept().model.ok_or("there are no parameters yet")?;
    let facts = folder.source().unwrap_or_default();
    let model = wire::model_of(&parameters, &facts.free_names).map_err(|error| format!("{error:#}"))?;
    let own_effects = model
        .axes
        .iter()
        .flatten()
        .flat_map(|axis| &axis.terms)
        .map(|term| term.effect)
        .filter(|effect| gyro_model::effects::find(effect.card().id).is_none())
        .collect();
    let provenance = Provenance {
        log: Some(facts.name),
        sha256: facts.sha256,
        fitted: Some(jiff::Timestamp::now()),
        samples: Some(parameters.samples as _),
        temperature: None,
    };
    let file = ModelFile { model, provenance: Some(provenance), own_effects };
    Ok(("application/toml", model_file::render(&file).into_bytes()))
}

fn page(scene: &Scene, folder: &RunFolder) -> Download {
    let diagnosis = scene.kept().diagnosis.clone().ok_or("there is no diagnosis yet")?;
    let name = folder.source().map_or_else(|_| diagnosis.log.clone(), |facts| facts.name);
    // Commands that read a log are run on the export of the last minutes.
    let context = Context::new(Command::Diagnose, "log.csv");
    let diagnosis = Diagnosis { log: format!("{name}, live"), ..diagnosis };
    Ok(("text/html; charset=utf-8", report::render(&diagnosis, Format::Html, &context).into_bytes()))
}

fn log(scene: &Scene, folder: &RunFolder) -> Download {
    let facts = folder.source().unwrap_or_default();
    let record = scene.record(facts.free_names);
    if record.is_empty() {
        return Err("no sample has come yet".into());
    }
    let written = || -> anyhow::Result<Vec<u8>> {
        let place = tempfile::tempdir()?;
        let path = place.path().join("log.csv");
        log::write_record(&path, &record, facts.start_ns)?;
        Ok(std::fs::read(&path)?)
    };
    Ok(("text/csv", written().map_err(|error| format!("{error:#}"))?))
}
