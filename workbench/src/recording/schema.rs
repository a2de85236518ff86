//! What a message holds: a protobuf schema made of a log's columns.

use anyhow::{Context as _, Result};
use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, Value,
    prost::Message as _,
    prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    },
};

/// The integer time, ns, of a message; its first field.
pub const TIME: &str = "t_ns";
const PACKAGE: &str = "truerate";

/// A message of an integer time and one `double` a column.
///
/// Field names are those of the columns as far as protobuf can spell them; the column's own name is the field's JSON name.
/// Every field stands in every message, NaN where there is no value: viewers would draw a missing one as zero.
pub struct Schema {
    message: MessageDescriptor,
    time: FieldDescriptor,
    columns: Vec<FieldDescriptor>,
}

impl Schema {
    /// The schema of a channel's messages.
    ///
    /// # Errors
    /// Two columns of one name.
    pub fn new(topic: &str, columns: &[String]) -> Result<Self> {
        let mut fields = vec![field(TIME, 1, TIME.to_owned(), Type::Int64)];
        for (column, number) in columns.iter().zip(2..) {
            let mut name = identifier(column);
            while fields.iter().any(|f| f.name() == name) {
                name.push('_');
            }
            fields.push(field(column, number, name, Type::Double));
        }
        let name = topic.trim_start_matches('/').to_owned();
        let full_name = format!("{PACKAGE}.{name}");
        let file = FileDescriptorProto {
            name: Some(format!("{PACKAGE}/{name}.proto")),
            package: Some(PACKAGE.to_owned()),
            message_type: vec![DescriptorProto { name: Some(name), field: fields, ..Default::default() }],
            ..Default::default()
        };
        let pool = DescriptorPool::from_file_descriptor_set(FileDescriptorSet { file: vec![file] })?;
        Self::of(&pool, &full_name).context("a message without fields")
    }

    /// The schema that stands in a recording; `None` where it is none of ours.
    pub fn decode(name: &str, bytes: &[u8]) -> Option<Self> {
        Self::of(&DescriptorPool::decode(bytes).ok()?, name)
    }

    fn of(pool: &DescriptorPool, name: &str) -> Option<Self> {
        let message = pool.get_message_by_name(name)?;
        let (time, columns): (Vec<_>, Vec<_>) = message.fields().partition(|field| field.name() == TIME);
        let time = time.into_iter().next().filter(|_| !columns.is_empty())?;
        Some(Self { message, time, columns })
    }

    /// Its full name.
    pub fn name(&self) -> &str {
        self.message.full_name()
    }

    /// As it stands in a recording.
    pub fn encoded(&self) -> Vec<u8> {
        self.message.parent_pool().encode_to_vec()
    }

    /// The names of the columns, in order.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(FieldDescriptor::json_name)
    }

    /// Appends the bytes of a message.
    ///
    /// # Errors
    /// None that has been seen: a buffer grows.
    pub fn encode(&self, time_ns: i64, values: &[f64], bytes: &mut Vec<u8>) -> Result<()> {
        let mut message = DynamicMessage::new(self.message.clone());
        message.set_field(&self.time, Value::I64(time_ns));
        for (column, value) in self.columns.iter().zip(values) {
            message.set_field(column, Value::F64(*value));
        }
        Ok(message.encode(bytes)?)
    }

    /// Time and values of a message; `None` where the bytes are none of this schema's.
    pub fn read(&self, bytes: &[u8], values: &mut Vec<f64>) -> Option<i64> {
        let message = DynamicMessage::decode(self.message.clone(), bytes).ok()?;
        values.clear();
        for column in &self.columns {
            values.push(if message.has_field(column) { message.get_field(column).as_f64()? } else { f64::NAN });
        }
        message.get_field(&self.time).as_i64().filter(|_| message.has_field(&self.time))
    }
}

fn field(column: &str, number: i32, name: String, kind: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name),
        json_name: Some(column.to_owned()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        ..Default::default()
    }
}

/// A column's name as protobuf can spell it.
fn identifier(column: &str) -> String {
    let spelt: String = column.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if spelt.starts_with(|c: char| c.is_ascii_digit()) || spelt.is_empty() { format!("_{spelt}") } else { spelt }
}
