//! A reference that comes another way than the gyro: its newest reading joins the gyro's next row. How late it is then, the
//! effect `delay` finds.

use super::{Address, Stream};
use crate::stop::Stop;
use gyro_model::Row;
use std::time::Duration;
use workbench::log::Options;

/// A reference on its way.
#[derive(Debug)]
pub struct Joined {
    stream: Option<Stream>,
    opening: Option<std::sync::mpsc::Receiver<anyhow::Result<Option<Stream>>>>,
}

impl Joined {
    /// Looks for it from now on; the gyro does not wait.
    ///
    /// # Errors
    /// Where no thread can be started.
    pub fn open(address: &Address, options: &Options, stop: &Stop) -> anyhow::Result<Self> {
        let (give, opening) = std::sync::mpsc::sync_channel(1);
        let address = address.clone().of_reference();
        let (options, stop) = (options.clone(), stop.clone());
        std::thread::Builder::new().name("reference".to_owned()).spawn(move || {
            let _ = give.send(Stream::open(&address, &options, None, &stop, |_| Ok(())));
        })?;
        Ok(Self { stream: None, opening: Some(opening) })
    }

    /// Gives a row the newest reading that has come since the last one.
    ///
    /// # Errors
    /// A header in the address that is none.
    pub fn join(&mut self, row: &mut Row) -> anyhow::Result<()> {
        if let Some(opened) = self.opening.as_ref().and_then(|opening| opening.try_recv().ok()) {
            self.opening = None;
            self.stream = opened?;
        }
        let Some(stream) = &self.stream else { return Ok(()) };
        while let Some(Some(arrival)) = stream.next(Duration::ZERO)? {
            let pairs = row.ref_angle.iter_mut().zip(arrival.row.ref_angle);
            let pairs = pairs.chain(row.ref_rate.iter_mut().zip(arrival.row.ref_rate));
            for (place, value) in pairs.chain(row.ref_quaternion.iter_mut().zip(arrival.row.ref_quaternion)) {
                if value.is_finite() {
                    *place = value;
                }
            }
        }
        Ok(())
    }
}
