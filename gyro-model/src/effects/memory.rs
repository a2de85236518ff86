//! What an effect remembers from sample to sample.

use bytemuck::Pod;

/// Room for what an effect remembers (a play's position, a filter's state): a struct of its own, of numbers, all zero at the start of a log.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Memory([f64; Self::NUMBERS]);

impl Memory {
    /// Numbers that it holds; a C function of an effect gets as many.
    pub const NUMBERS: usize = 8;

    /// The same as the effect's own struct, to be read and written.
    pub fn of<T: Pod>(&mut self) -> &mut T {
        const { assert!(size_of::<T>() <= size_of::<Self>()) }
        bytemuck::from_bytes_mut(&mut bytemuck::bytes_of_mut(&mut self.0)[..size_of::<T>()])
    }

    /// The same to be read.
    #[must_use]
    pub fn seen<T: Pod>(&self) -> &T {
        const { assert!(size_of::<T>() <= size_of::<Self>()) }
        bytemuck::from_bytes(&bytemuck::bytes_of(&self.0)[..size_of::<T>()])
    }
}
