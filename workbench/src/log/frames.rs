//! Frames of a CAN bus that come one by one, as rows: what the messages of the DBC file hold by their names and the maps.

use super::{
    Maps,
    header::Layout,
    messages::{Has, Taken, understood},
};
use anyhow::{anyhow, bail};
use gyro_model::Row;
use log_readers::{
    can::{Database, Frame, database::shown},
    formats::can::channels,
    meaning::{Pick, Proposal, of_names},
};
use std::collections::HashMap;

/// Makes rows of frames.
pub struct Frames {
    database: Database,
    layout: Layout,
    taken: Taken,
    /// Of each message that is wanted, by its identifier.
    wanted: HashMap<u32, Wanted>,
    values: Vec<f64>,
}

/// What is wanted of a message.
struct Wanted {
    /// The places of its signals, each with the number of its pick.
    signals: Vec<(usize, usize)>,
    /// Who sent it first: the bus and the identifier there. Another sender of the same message is another sensor.
    sender: Option<(Vec<u8>, u32)>,
}

impl Frames {
    /// Of the DBC file of these maps.
    ///
    /// # Errors
    /// There is none, or none of its signals is what every source needs.
    pub fn new(maps: &Maps) -> anyhow::Result<Self> {
        let Some(database) = maps.database.clone() else {
            bail!("what the frames of a CAN bus mean is defined in a DBC file: …?dbc=FILE.dbc, or --dbc FILE.dbc");
        };
        let named = channels(&database);
        let flat: Vec<_> = named.iter().flatten().cloned().collect();
        let propose = |taken: Has, _: &[Pick]| -> Proposal { of_names(&flat, taken) };
        let (picks, layout) =
            understood(maps, &flat, &propose).map_err(|(_, problem)| anyhow!("the DBC file: {problem}"))?;
        let mut wanted = HashMap::new();
        for (message, signals) in database.messages().iter().zip(&named) {
            let place = |pick: &Pick| signals.iter().position(|(name, _)| *name == pick.channel);
            let places = picks.iter().enumerate().filter_map(|(number, pick)| Some((place(pick)?, number)));
            let signals: Vec<(usize, usize)> = places.collect();
            if !signals.is_empty() {
                wanted.insert(message.id, Wanted { signals, sender: None });
            }
        }
        Ok(Self { database, taken: Taken::new(&layout), layout, wanted, values: Vec::new() })
    }

    /// The messages that are wanted: `IMU 0x100, ENCODER 0x101`.
    #[must_use]
    pub fn names(&self) -> String {
        let wanted = self.database.messages().iter().filter(|message| self.wanted.contains_key(&message.id));
        wanted.map(|message| format!("{} {}", message.name, shown(message.id))).collect::<Vec<_>>().join(", ")
    }

    /// What the rows hold.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The row of a frame, and whether a value in it was none; `None` where nothing of the frame is wanted.
    pub fn row(&mut self, frame: &Frame) -> Option<(Row, bool)> {
        let message = self.database.find(frame.id)?.message;
        let wanted = self.wanted.get_mut(&message.id)?;
        let (bus, id) = wanted.sender.get_or_insert_with(|| (frame.bus.to_vec(), frame.id));
        if bus != frame.bus || *id != frame.id {
            return None;
        }
        message.decode(frame.data(), &mut self.values);
        let (mut row, mut wrong) = (Row::EMPTY, false);
        self.taken.put(&mut row, &wanted.signals, &self.values, &mut |_, _| wrong = true);
        Some((row, wrong))
    }
}
