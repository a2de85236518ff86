//! What a pipeline records: the rows of `apply`, and a recording that replays.

use crate::harness::{Place, log};
use std::{fs, path::Path};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A frozen, unpaced run of `source` with this model, recorded.
fn record(place: &Place, instance: &str, source: &Path, model: &Path, to: &Path) {
    let args = ["--source", text(source), "--speed", "max", "--freeze", "--model", text(model), "--record", text(to)];
    let ended = place.start(instance, &args).end();
    assert_eq!(ended.code, Some(0), "{}{}", ended.out, ended.error);
}

#[test]
fn a_frozen_run_records_what_apply_writes_and_its_mcap_recording_replays_to_the_same_bytes() {
    let place = Place::new();
    let (source, model) = (place.file("log.csv"), place.file("m.toml"));
    log(&source, 20.0, 5);
    let fit = place.output(&["fit", text(&source), "-o", text(&model)]);
    assert!(fit.status.success(), "{}", String::from_utf8_lossy(&fit.stderr));

    let applied = place.file("applied.csv");
    let apply = place.output(&["apply", text(&source), "--model", text(&model), "-o", text(&applied)]);
    assert!(apply.status.success(), "{}", String::from_utf8_lossy(&apply.stderr));
    let applied = fs::read(&applied).unwrap();
    assert!(applied.len() > 100_000);

    let straight = place.file("straight.csv");
    record(&place, "straight", &source, &model, &straight);
    assert!(fs::read(&straight).unwrap() == applied, "the run's rows differ from those of apply");

    let recording = place.file("recording.mcap");
    record(&place, "recorded", &source, &model, &recording);
    let replayed = place.file("replayed.csv");
    record(&place, "replayed", &recording, &model, &replayed);
    assert!(fs::read(&replayed).unwrap() == applied, "the replay's rows differ from those of apply");
}
