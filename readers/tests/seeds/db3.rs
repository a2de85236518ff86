//! An SQLite database, page by page: two tables as ROS 2 writes them, and one of definitions.

use super::{IMU, MESSAGES, imu, stamp_ns};

const PAGE: usize = 4096;

enum Value<'a> {
    Null,
    Integer(i64),
    Text(&'a str),
    Blob(&'a [u8]),
}

fn varint(out: &mut Vec<u8>, value: u64) {
    assert!(value < 1 << 14);
    if value >= 0x80 {
        out.push(0x80 | (value >> 7) as u8);
    }
    out.push((value & 0x7f) as u8);
}

/// One row: its length, its number, its kinds, its values.
fn cell(rowid: u64, values: &[Value]) -> Vec<u8> {
    let (mut kinds, mut body) = (Vec::new(), Vec::new());
    for value in values {
        match value {
            Value::Null => kinds.push(0),
            Value::Integer(value) => {
                kinds.push(6);
                body.extend(value.to_be_bytes());
            }
            Value::Text(text) => {
                varint(&mut kinds, 13 + 2 * text.len() as u64);
                body.extend(text.as_bytes());
            }
            Value::Blob(bytes) => {
                varint(&mut kinds, 12 + 2 * bytes.len() as u64);
                body.extend(*bytes);
            }
        }
    }
    let mut out = Vec::new();
    varint(&mut out, (1 + kinds.len() + body.len()) as u64);
    varint(&mut out, rowid);
    out.push(1 + kinds.len() as u8);
    out.extend(kinds);
    out.extend(body);
    out
}

/// A page of a tree: 13 a leaf, 5 with the number of its last child.
fn page(kind: u8, before: &[u8], cells: &[Vec<u8>], last: Option<u32>) -> Vec<u8> {
    let mut out = vec![0; PAGE];
    out[..before.len()].copy_from_slice(before);
    let (mut end, mut places) = (PAGE, Vec::new());
    for cell in cells {
        end -= cell.len();
        out[end..end + cell.len()].copy_from_slice(cell);
        places.extend((end as u16).to_be_bytes());
    }
    let mut head = vec![kind, 0, 0];
    head.extend((cells.len() as u16).to_be_bytes());
    head.extend((end as u16).to_be_bytes());
    head.push(0);
    head.extend(last.into_iter().flat_map(u32::to_be_bytes));
    head.extend(places);
    assert!(before.len() + head.len() <= end);
    out[before.len()..before.len() + head.len()].copy_from_slice(&head);
    out
}

pub fn db3() -> Vec<u8> {
    let table = |number: u32, name: &str, columns: &str| {
        let sql = format!("CREATE TABLE {name}({columns})");
        let values = [
            Value::Text("table"),
            Value::Text(name),
            Value::Text(name),
            Value::Integer(i64::from(number) + 1),
            Value::Text(&sql),
        ];
        cell(u64::from(number), &values)
    };
    let schema = [
        table(
            1,
            "topics",
            "id INTEGER PRIMARY KEY,name TEXT NOT NULL,type TEXT NOT NULL,serialization_format TEXT NOT NULL",
        ),
        table(
            2,
            "messages",
            "id INTEGER PRIMARY KEY,topic_id INTEGER NOT NULL,timestamp INTEGER NOT NULL,data BLOB NOT NULL",
        ),
        table(
            3,
            "message_definitions",
            "id INTEGER PRIMARY KEY,topic_type TEXT,encoding TEXT,encoded_message_definition TEXT",
        ),
    ];
    let topics = [cell(1, &[Value::Null, Value::Text("/imu"), Value::Text("sensor_msgs/msg/Imu"), Value::Text("cdr")])];
    let definition = IMU.replace("TIME", "builtin_interfaces/Time");
    let kind = [Value::Null, Value::Text("sensor_msgs/msg/Imu"), Value::Text("ros2msg"), Value::Text(&definition)];
    let definitions = [cell(1, &kind)];
    let rows: Vec<Vec<u8>> = (0..MESSAGES)
        .map(|k| {
            let time = Value::Integer(i64::try_from(stamp_ns(k)).unwrap() + 2_000_000);
            cell(k + 1, &[Value::Null, Value::Integer(1), time, Value::Blob(&imu(k, true))])
        })
        .collect();
    let leaves: Vec<Vec<u8>> = rows.chunks(20).map(|rows| page(13, &[], rows, None)).collect();
    let child = |k: usize| 5 + k as u32;
    let between: Vec<Vec<u8>> = (0..leaves.len() - 1)
        .map(|k| {
            let mut cell = child(k).to_be_bytes().to_vec();
            varint(&mut cell, 20 * (k as u64 + 1));
            cell
        })
        .collect();
    let root = page(5, &[], &between, Some(child(leaves.len() - 1)));
    let pages = 4 + leaves.len() as u32;
    let mut out = page(13, &header(pages), &schema, None);
    out.extend(page(13, &[], &topics, None));
    out.extend(root);
    out.extend(page(13, &[], &definitions, None));
    out.extend(leaves.concat());
    out
}

fn header(pages: u32) -> Vec<u8> {
    let mut out = b"SQLite format 3\0".to_vec();
    out.extend((PAGE as u16).to_be_bytes());
    out.extend([1, 1, 0, 64, 32, 32]);
    for word in [1, pages, 0, 0, 1, 4, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1, 3_045_000_u32] {
        out.extend(word.to_be_bytes());
    }
    assert_eq!(out.len(), 100);
    out
}
