//! ROS 2's `.db3`: an SQLite database with a table of topics and one of messages.
//!
//! A database has to be read from any place, so that it is taken into memory whole. Its tables are walked in the order in which
//! rows came, which needs no index; where a page is missing or damaged, the rows before it are given.

use super::ros::{Connections, Wire};
use crate::format::{Format, Note, Place, Sink, Unreadable};
use quantydb_sqlite::{Reader, Source, SqliteError, SqliteValue, parse_create_table};
use std::{
    collections::HashMap,
    io::{self, Read},
};

/// A larger one is not taken into memory.
const LARGEST: u64 = 4 << 30;
/// Where the header counts the pages, and says whether that is to be believed.
const PAGE_COUNT: usize = 28;
const HEADER: usize = 100;

/// ROS 2's `.db3`.
pub struct Db3;

impl Format for Db3 {
    fn name(&self) -> &'static str {
        "ROS 2 .db3"
    }

    fn recognises(&self, start: &[u8]) -> bool {
        start.starts_with(b"SQLite format 3\0")
    }

    fn read(&self, bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut pages = Vec::new();
        bytes.take(LARGEST + 1).read_to_end(&mut pages)?;
        if pages.len() as u64 > LARGEST {
            return Err(Unreadable::Unknown("it is larger than 4 GiB: make an MCAP of it with `ros2 bag convert`"));
        }
        let ends_at = pages.len() as u64;
        let broken = cut_to_whole_pages(&mut pages);
        let damaged = |_| Unreadable::Unknown("it is not a whole SQLite database, or is of another kind");
        let database = Reader::open(Pages(pages)).map_err(damaged)?;
        let mut connections = Connections::new(sink);
        let tables = Tables::of(&database).map_err(damaged)?;
        let found = tables.messages(&database, &mut connections)?;
        if broken {
            connections.note(Note::BreaksOff { at: Place::Byte(ends_at) });
        } else if let Err(error) = found {
            let size = u64::from(database.header().page_size);
            let page = if let SqliteError::Malformed { page: Some(page), .. } = error { page } else { 1 };
            connections.note(Note::Damaged { at: Place::Byte(u64::from(page.saturating_sub(1)) * size), bytes: size });
        }
        connections.finish();
        Ok(())
    }
}

/// Says in the header that there are as many pages as there are, where it says that there are more.
fn cut_to_whole_pages(bytes: &mut [u8]) -> bool {
    if bytes.len() < HEADER {
        return true;
    }
    let size = match u16::from_be_bytes([bytes[16], bytes[17]]) {
        1 => 1 << 16,
        size => u64::from(size.max(512)),
    };
    let there = u32::try_from(bytes.len() as u64 / size).unwrap_or(u32::MAX);
    let said = u32::from_be_bytes([bytes[28], bytes[29], bytes[30], bytes[31]]);
    let broken = said > there;
    if broken {
        bytes[PAGE_COUNT..PAGE_COUNT + 4].copy_from_slice(&there.to_be_bytes());
    }
    broken
}

/// A database in memory.
struct Pages(Vec<u8>);

impl Source for Pages {
    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> Result<(), SqliteError> {
        let from = usize::try_from(offset).ok().filter(|from| *from <= self.0.len());
        let found = from.and_then(|from| self.0[from..].get(..buffer.len()));
        buffer.copy_from_slice(found.ok_or(io::Error::from(io::ErrorKind::UnexpectedEof))?);
        Ok(())
    }

    fn len(&self) -> Result<u64, SqliteError> {
        Ok(self.0.len() as u64)
    }

    /// Whoever opened the file looked whether a log lies beside it.
    fn accounts_for_wal(&self) -> bool {
        true
    }
}

/// A table: where it begins, and which column is where.
struct Table {
    root: u32,
    columns: HashMap<String, usize>,
}

impl Table {
    /// The column of a row; the key of a table stands beside its values.
    fn integer(&self, name: &str, rowid: i64, values: &[SqliteValue]) -> Option<i64> {
        match values.get(*self.columns.get(name)?)? {
            SqliteValue::Integer(value) => Some(*value),
            SqliteValue::Null if name == "id" => Some(rowid),
            _ => None,
        }
    }

    fn text<'a>(&self, name: &str, values: &'a [SqliteValue]) -> Option<&'a str> {
        match values.get(*self.columns.get(name)?)? {
            SqliteValue::Text(text) => Some(text),
            _ => None,
        }
    }
}

/// The tables of a database by their names.
struct Tables(HashMap<String, Table>);

impl Tables {
    /// The database's own list of its tables stands in its first page.
    fn of(database: &Reader<Pages>) -> Result<Self, SqliteError> {
        let mut tables = HashMap::new();
        for row in database.table_scan(1)?.map_while(Result::ok) {
            let [
                SqliteValue::Text(kind),
                SqliteValue::Text(name),
                _,
                SqliteValue::Integer(root),
                SqliteValue::Text(sql),
            ] = row.values.as_slice()
            else {
                continue;
            };
            let (Ok(root), Ok(table)) = (u32::try_from(*root), parse_create_table(sql)) else { continue };
            if kind == "table" {
                let columns = table.columns.iter().enumerate().map(|(i, column)| (column.name.clone(), i)).collect();
                tables.insert(name.clone(), Table { root, columns });
            }
        }
        Ok(Self(tables))
    }

    /// Gives all messages; what ended them where they are not all.
    fn messages(
        &self,
        database: &Reader<Pages>,
        connections: &mut Connections,
    ) -> Result<Result<(), SqliteError>, Unreadable> {
        let (Some(topics), Some(messages)) = (self.0.get("topics"), self.0.get("messages")) else {
            return Err(Unreadable::Unknown("it has no tables `topics` and `messages`, as ROS 2 writes them"));
        };
        let definitions = self.definitions(database);
        let connected = connect(topics, database, &definitions, connections);
        Ok(connected.and_then(|()| {
            for row in database.table_scan(messages.root)? {
                let row = row?;
                let (Some(topic), Some(time), Some(SqliteValue::Blob(data))) = (
                    messages.integer("topic_id", row.rowid, &row.values).and_then(|id| u32::try_from(id).ok()),
                    messages.integer("timestamp", row.rowid, &row.values),
                    messages.columns.get("data").and_then(|column| row.values.get(*column)),
                ) else {
                    continue;
                };
                connections.message(topic, time, data);
            }
            Ok(())
        }))
    }

    /// What messages of each kind hold. Before ROS 2 Iron nothing of it was recorded.
    fn definitions(&self, database: &Reader<Pages>) -> HashMap<String, String> {
        let Some(table) = self.0.get("message_definitions") else { return HashMap::new() };
        let Ok(rows) = database.table_scan(table.root) else { return HashMap::new() };
        let of = rows.map_while(Result::ok).filter_map(|row| {
            let text = |name| table.text(name, &row.values);
            (text("encoding")? == "ros2msg")
                .then_some((text("topic_type")?.to_owned(), text("encoded_message_definition")?.to_owned()))
        });
        of.collect()
    }
}

/// Takes up the topics of a table.
fn connect(
    table: &Table,
    database: &Reader<Pages>,
    definitions: &HashMap<String, String>,
    connections: &mut Connections,
) -> Result<(), SqliteError> {
    for row in database.table_scan(table.root)? {
        let row = row?;
        let text = |name| table.text(name, &row.values);
        let (Some(id), Some(topic), Some(kind)) =
            (table.integer("id", row.rowid, &row.values), text("name"), text("type"))
        else {
            continue;
        };
        if text("serialization_format").is_some_and(|format| format != "cdr") {
            connections.not_read(topic, "their encoding is not known: only CDR is read");
            continue;
        }
        if let Ok(id) = u32::try_from(id) {
            let definition = definitions.get(kind).map_or("", String::as_str);
            connections.connect(id, topic, kind, Wire::Cdr, definition);
        }
    }
    Ok(())
}
