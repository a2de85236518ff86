//! Logs that come with nothing wrong in them are read without complaint.

use std::path::PathBuf;
use workbench::log::{self, Options};

/// The folder of logs to try things on: `TRUERATE_LOGS`, or the one beside the checkout.
fn logs() -> Option<PathBuf> {
    let folder = std::env::var_os("TRUERATE_LOGS")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    if !folder.is_dir() {
        eprintln!("skipped: no folder {}; set TRUERATE_LOGS", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn logs_of_real_and_simulated_sensors_show_no_fault_but_true_gaps() {
    let Some(folder) = logs() else { return };
    let mut read = 0;
    for part in ["hidden", "recorded"] {
        for entry in std::fs::read_dir(folder.join(part)).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.extension().is_none_or(|e| e != "gz") {
                continue;
            }
            let options = Options { needs_reference: true, ..Options::default() };
            let (record, faults, provenance) = log::read(&path, &options).unwrap();
            assert_eq!(record.len() as u64, provenance.samples);
            assert_eq!(provenance.sha256.len(), 64);
            for fault in faults {
                // Real recordings lose or repeat a sample in a hundred, and one was made at rest with a sensor that hung.
                let is_rare = (fault.count as f64) < 0.01 * record.len() as f64;
                let is_small = is_rare && ["dropouts", "repeated-samples"].contains(&fault.kind.name());
                let rests = ["not-excited", "stuck-channel"].contains(&fault.kind.name())
                    && path.to_string_lossy().contains("at-rest");
                assert!(part == "recorded" && (is_small || rests), "{path:?}: {fault:?}");
            }
            read += 1;
        }
    }
    assert!(read > 0, "no log in {}", folder.display());
}
