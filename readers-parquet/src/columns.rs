//! The columns of a schema: names, widths, kinds of values.

use parquet::{
    basic::{ConvertedType, LogicalType, Repetition, TimeUnit, Type as Physical},
    schema::types::{ColumnDescPtr, ColumnDescriptor, Type},
};

/// Items of a list at most: more are no reading but a picture or a scan.
pub const LONGEST_LIST: usize = 64;

/// What the values of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Numbers, as they are stored.
    Number,
    /// Whole numbers without a sign.
    Unsigned,
    /// Whole numbers of so many decimal places.
    Decimal(i32),
    /// Floating-point numbers of 16 bits.
    Half,
    /// Times since 1970, each of so many nanoseconds, written with so many decimal places.
    Moment(i128, usize),
    /// Times of day, the same.
    Clock(i128, usize),
    /// Days since 1970.
    Day,
    /// Text.
    Text,
}

/// A column that can be written as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Which of the file's columns it is.
    pub leaf: usize,
    /// What its values are.
    pub kind: Kind,
    /// The level of definition at which a value is there.
    pub deepest: i16,
    /// Its name up to the list that it is in; the whole name where it is in none.
    pub name: String,
    /// What follows the number of the list's item; `None` outside lists.
    pub within: Option<String>,
}

impl Column {
    /// The names of its fields in a row; of a list of so many items.
    #[must_use]
    pub fn names(&self, width: usize) -> Vec<String> {
        let Some(within) = &self.within else { return vec![self.name.clone()] };
        let item = |k: usize| match (width, k) {
            (3, 0) => "x".to_owned(),
            (3, 1) => "y".to_owned(),
            (3, 2) => "z".to_owned(),
            _ => k.to_string(),
        };
        (0..width).map(|k| format!("{}.{}{within}", self.name, item(k))).collect()
    }
}

/// The columns of a schema that hold numbers, times or text, in order; and the names of those that hold anything else.
#[must_use]
pub fn of(root: &Type, leaves: &[ColumnDescPtr]) -> (Vec<Column>, Vec<String>) {
    let mut paths = Vec::new();
    if let Type::GroupType { fields, .. } = root {
        for field in fields {
            below(field, &Path::default(), &mut paths);
        }
    }
    let (mut columns, mut others) = (Vec::new(), Vec::new());
    for (leaf, (path, of)) in paths.into_iter().zip(leaves).enumerate() {
        let name = path.before.join(".");
        match kind(of).filter(|_| of.max_rep_level() <= 1) {
            Some(kind) => {
                let dotted = |text: String, part: &String| text + "." + part;
                let within = path.within.map(|within| within.iter().fold(String::new(), dotted));
                columns.push(Column { leaf, kind, deepest: of.max_def_level(), name, within });
            }
            None => others.push(name),
        }
    }
    (columns, others)
}

/// The names that lead to a column.
#[derive(Clone, Default)]
struct Path {
    before: Vec<String>,
    /// Below a list.
    within: Option<Vec<String>>,
}

impl Path {
    fn and(&self, name: &str) -> Self {
        let mut path = self.clone();
        path.within.as_mut().unwrap_or(&mut path.before).push(name.to_owned());
        path
    }

    fn item(&self) -> Self {
        Self { within: Some(self.within.clone().unwrap_or_default()), ..self.clone() }
    }
}

/// Adds the paths to all columns below a node. How a list is wrapped says nothing: `gyro.list.element` is an item of `gyro`.
fn below(node: &Type, path: &Path, found: &mut Vec<Path>) {
    let own = path.and(node.name());
    let repeats = |node: &Type| {
        node.get_basic_info().has_repetition() && node.get_basic_info().repetition() == Repetition::REPEATED
    };
    let own = if repeats(node) { own.item() } else { own };
    let Type::GroupType { fields, .. } = node else {
        found.push(own);
        return;
    };
    if !is_list(node) {
        for field in fields {
            below(field, &own, found);
        }
        return;
    }
    for field in fields {
        match &**field {
            Type::GroupType { fields: items, .. } if items.len() == 1 => {
                inside(&items[0], &own.item(), found);
            }
            other => inside(other, &own.item(), found),
        }
    }
}

/// The same of what a list holds, whose own name says nothing.
fn inside(item: &Type, path: &Path, found: &mut Vec<Path>) {
    match item {
        Type::GroupType { fields, .. } if !is_list(item) => {
            for field in fields {
                below(field, path, found);
            }
        }
        Type::GroupType { .. } => below(item, path, found),
        Type::PrimitiveType { .. } => found.push(path.clone()),
    }
}

fn is_list(node: &Type) -> bool {
    let info = node.get_basic_info();
    info.converted_type() == ConvertedType::LIST || matches!(info.logical_type_ref(), Some(LogicalType::List))
}

fn kind(of: &ColumnDescriptor) -> Option<Kind> {
    let (physical, converted) = (of.physical_type(), of.converted_type());
    if physical == Physical::INT96 {
        return Some(Kind::Moment(1, 9));
    }
    let step = |unit: &TimeUnit| match unit {
        TimeUnit::MILLIS => (1_000_000, 3),
        TimeUnit::MICROS => (1_000, 6),
        TimeUnit::NANOS => (1, 9),
    };
    match of.logical_type_ref() {
        Some(LogicalType::Timestamp(of)) => {
            let (ns, digits) = step(&of.unit);
            return Some(Kind::Moment(ns, digits));
        }
        Some(LogicalType::Time(of)) => {
            let (ns, digits) = step(&of.unit);
            return Some(Kind::Clock(ns, digits));
        }
        Some(LogicalType::Date) => return Some(Kind::Day),
        Some(LogicalType::Decimal(of)) => return Some(Kind::Decimal(of.scale)),
        Some(LogicalType::Integer(of)) if !of.is_signed => return Some(Kind::Unsigned),
        Some(LogicalType::Float16) => return Some(Kind::Half),
        Some(LogicalType::String | LogicalType::Enum) => return Some(Kind::Text),
        _ => {}
    }
    match converted {
        ConvertedType::TIMESTAMP_MILLIS => Some(Kind::Moment(1_000_000, 3)),
        ConvertedType::TIMESTAMP_MICROS => Some(Kind::Moment(1_000, 6)),
        ConvertedType::TIME_MILLIS => Some(Kind::Clock(1_000_000, 3)),
        ConvertedType::TIME_MICROS => Some(Kind::Clock(1_000, 6)),
        ConvertedType::DATE => Some(Kind::Day),
        ConvertedType::DECIMAL => Some(Kind::Decimal(of.type_scale())),
        ConvertedType::UINT_8 | ConvertedType::UINT_16 | ConvertedType::UINT_32 | ConvertedType::UINT_64 => {
            Some(Kind::Unsigned)
        }
        ConvertedType::UTF8 | ConvertedType::ENUM => Some(Kind::Text),
        _ => (!matches!(physical, Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY)).then_some(Kind::Number),
    }
}
