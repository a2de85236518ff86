//! Running the real program on logs made for the purpose.

#![allow(dead_code)] // each test file uses a part

use std::{
    fmt::Write as _,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};
use tempfile::TempDir;

/// A folder of its own for every test, and the program run in it.
pub struct Bench {
    folder: TempDir,
}

/// What the program did.
#[derive(Debug)]
pub struct Outcome {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Bench {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn file(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// Runs `truerate` with these words in this folder.
    pub fn run(&self, words: &[&str]) -> Outcome {
        self.run_with(words, b"")
    }

    /// The same with standard input.
    pub fn run_with(&self, words: &[&str], input: &[u8]) -> Outcome {
        let mut child =
            self.command(words).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut stdin = child.stdin.take().unwrap();
        let bytes = input.to_vec();
        // A program that refuses its input early leaves the rest unread: not this test's concern.
        let feeder = std::thread::spawn(move || drop(stdin.write_all(&bytes)));
        let output = child.wait_with_output().unwrap();
        feeder.join().unwrap();
        Outcome::of(&output)
    }

    pub fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_truerate"));
        command.args(words).current_dir(self.folder.path()).env_remove("TRUERATE_LOG").env("RUST_BACKTRACE", "0");
        command
    }

    /// Runs and wants success.
    pub fn ok(&self, words: &[&str]) -> String {
        let outcome = self.run(words);
        assert_eq!(outcome.code, 0, "truerate {words:?}: {outcome:?}");
        outcome.out
    }

    /// Runs and wants the one line of a refusal, which it returns.
    pub fn refused(&self, words: &[&str]) -> String {
        let outcome = self.run(words);
        outcome.refusal(&format!("truerate {words:?}"))
    }
}

impl Outcome {
    pub fn of(output: &Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// The one line of a refusal, or three where a command is offered: exit 1, nothing printed, no panic.
    pub fn refusal(&self, what: &str) -> String {
        assert_eq!(self.code, 1, "{what}: {self:?}");
        assert!(matches!(self.err.lines().count(), 1 | 3), "{what}: {self:?}");
        assert!(self.err.starts_with("truerate: ") && !self.err.contains("panicked"), "{what}: {self:?}");
        assert!(self.err.len() < 1200, "{what}: a line to read, not {} bytes", self.err.len());
        assert_eq!(self.out, "", "{what}: {self:?}");
        self.err.trim_end().to_owned()
    }
}

/// A small log of a turning z axis, 10 Hz · `rows`, with an encoder.
pub fn log(rows: usize) -> String {
    let mut text = String::from("t,gyro_z,ref_angle_z\n");
    for k in 0..rows {
        let t = k as f64 * 0.01;
        let (rate, angle) =
            (2.0 * (1.3 * t).cos() + (2.9 * t).cos(), 2.0 / 1.3 * (1.3 * t).sin() + (2.9 * t).sin() / 2.9);
        // A little noise that repeats nothing: the gyro of a log is never smooth.
        let noise = 0.002 * (((k * 7919 + 13) % 997) as f64 / 997.0 - 0.5);
        let _ = writeln!(text, "{t:.2},{:.6},{:.6}", rate / 0.99 + 0.01 + noise, angle + 0.1 * noise);
    }
    text
}

/// The words of the command that a refusal ends in, where there is one.
pub fn advised(refusal: &str) -> Option<Vec<String>> {
    let command = refusal.lines().find_map(|line| line.strip_prefix("truerate "))?;
    // Every other part stands between quotation marks.
    let words = |(i, part): (usize, &str)| -> Vec<String> {
        if i % 2 == 1 { vec![part.to_owned()] } else { part.split_whitespace().map(str::to_owned).collect() }
    };
    Some(command.split('\'').enumerate().flat_map(words).collect())
}

/// The log's rows with one field replaced; line 1 is the header.
pub fn with_field(text: &str, line: usize, column: usize, value: &str) -> String {
    let mut out = String::new();
    for (i, row) in text.lines().enumerate() {
        if i + 1 == line {
            let mut fields: Vec<&str> = row.split(',').collect();
            fields[column - 1] = value;
            out.push_str(&fields.join(","));
        } else {
            out.push_str(row);
        }
        out.push('\n');
    }
    out
}

/// Packed as `gzip` packs.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

/// Whether a file stands here and nothing else of ours beside it.
pub fn only_file(folder: &Path, name: &str) -> bool {
    std::fs::read_dir(folder).unwrap().flatten().all(|e| e.file_name() == name)
}
