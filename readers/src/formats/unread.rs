//! Files that are not read, known by their beginning, and what makes one that is.

use crate::{
    json,
    packed::ZSTD,
    text::{is_row, stamp},
};

/// What a file is, and what to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unread {
    /// What it is.
    pub what: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

const JSON: &str = "write it as CSV: pandas.read_json(F).to_csv(G, index=False); records, one a line or in a list, are read as they are";

const PICKLE: &str = "write it as CSV: pandas.read_pickle(F).to_csv(G, index=False)";

const KNOWN: &[(&[u8], &str, &str)] = &[
    (
        b"SQLite format 3\0",
        "an SQLite database (a ROS 2 .db3?)",
        "the program, on a computer, reads a ROS 2 .db3; or make an MCAP of it: `ros2 bag convert`",
    ),
    (b"PAR1", "a Parquet file", "write it as CSV: pandas.read_parquet(F).to_csv(G, index=False)"),
    (b"PK\x03\x04", "a zip archive (a phone's export, or an .xlsx)", "unpack it, or save the sheet as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel sheet", "save it as CSV"),
    (b"H Product:Blackbox", "a raw Betaflight log", "decode it: `blackbox_decode LOG.BBL`"),
    (b"\x89HDF", "an HDF5 file (a new .mat?)", "write it as CSV: in MATLAB, writetimetable(T, \"log.csv\")"),
    (b"MATLAB 5.0", "a .mat file", "write it as CSV: writetimetable(T, \"log.csv\")"),
    (b"BZh", "packed with bzip2", "unpack it: `bunzip2`"),
    (b"\xfd7zXZ", "packed with xz", "unpack it: `unxz`"),
    (b"7z\xbc\xaf", "a 7z archive", "unpack it"),
    (b"\x80\x02", "a pickle of Python", PICKLE),
    (b"\x80\x03", "a pickle of Python", PICKLE),
    (b"\x80\x04\x95", "a pickle of Python", PICKLE),
    (b"\x80\x05\x95", "a pickle of Python", PICKLE),
    (b"\x93NUMPY", "a NumPy array", "write it as text: numpy.savetxt with a header"),
    (b"\xa3\x95", "an ArduPilot log without its beginning", "copy it again"),
    (b"<?xml", "XML", "export it as CSV"),
    (b"VERSION \"", "a DBC file", "it says what the frames of a CAN log mean: give it together with that log"),
    (b"{", "JSON", JSON),
    (b"[", "JSON", JSON),
];

/// What begins like this is of no text: a file that is read only as a file, or not at all.
#[must_use]
pub fn of_no_text(start: &[u8]) -> Option<Unread> {
    const AS_A_FILE: &str = "give it as a file: a stream is lines of text";
    let packed: [(&[u8], &str); 3] =
        [(b"\x1f\x8b", "packed with gzip"), (&ZSTD, "packed with zstd"), (b"\x89MCAP0\r\n", "an MCAP recording")];
    if let Some((_, what)) = packed.iter().find(|(magic, _)| start.starts_with(magic)) {
        return Some(Unread { what, remedy: AS_A_FILE });
    }
    let is_text = |magic: &[u8]| magic.iter().all(|b| b.is_ascii_graphic() || *b == b' ');
    let known = KNOWN.iter().find(|(magic, ..)| !is_text(magic) && start.starts_with(magic));
    known.map(|&(_, what, remedy)| Unread { what, remedy })
}

/// What a file that begins like this is, where it is none that is read.
#[must_use]
pub fn unread(start: &[u8]) -> Option<Unread> {
    let known = KNOWN.iter().find(|(magic, ..)| start.starts_with(magic));
    let is_binary = |bytes: &[u8]| bytes.iter().any(|&b| b < b' ' && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c));
    let holds = |magic: &[u8]| match magic {
        b"{" => !json::is_records(start),
        // A list a line, or a time in brackets.
        b"[" => {
            let is_text = |line: &&[u8]| is_row(line) || stamp(line).is_some();
            !json::is_records(start) && start.split(|&b| b == b'\n').take(3).filter(is_text).count() < 2
        }
        // The headers may stand above the decoded rows.
        b"H Product:Blackbox" => is_binary(start),
        _ => true,
    };
    if let Some(&(_, what, remedy)) = known.filter(|(magic, ..)| holds(magic)) {
        return Some(Unread { what, remedy });
    }
    let binary = start.iter().filter(|&&b| b < b' ' && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c)).count();
    (8 * binary > start.len()).then_some(Unread {
        what: "no text, and of no format that is read",
        remedy: "export it as CSV from the program that wrote it",
    })
}
