//! What the page is told meanwhile.

/// What the page is told while something is worked on.
#[derive(Clone, Copy, Debug)]
#[repr(u32)]
pub enum Told {
    /// What is being done.
    Progress = 0,
    /// A step of a ladder.
    Step = 1,
    /// What went wrong on one axis.
    Failed = 2,
    /// That nothing more can be asked: the program has a mistake.
    Panic = 3,
}

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    fn told(kind: u32, text: *const u8, length: usize);
}

/// Tells the page.
pub fn tell(kind: Told, text: &str) {
    // SAFETY: the page reads these bytes before it returns.
    unsafe { told(kind as u32, text.as_ptr(), text.len()) }
}
