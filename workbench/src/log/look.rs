//! A look at a file of any format: what it holds, and how its channels would be named.

use super::{
    LogError, Options, dbc,
    error::Problem,
    folder::{self, Continued},
    input::Input,
    lacking::Advice,
    unit,
};
use log_readers::{
    format::Note,
    meaning::{Pick, Proposal, of_text, of_topics},
    survey::Survey,
    text::Table,
};
use std::path::Path;

/// What a file holds.
pub struct Look {
    /// The name of its format.
    pub format: &'static str,
    /// Its topics and their fields.
    pub survey: Survey,
    /// Names that are those of a log already.
    pub own: Vec<String>,
    /// A map to the names of a log.
    pub proposal: Proposal,
    /// What makes a log of it where the map alone does not.
    pub advice: Option<Advice>,
}

impl Look {
    /// Whether there were frames, and the DBC file names none of them.
    #[must_use]
    pub fn has_no_channel(&self) -> bool {
        let passed = self.survey.notes.iter().any(|note| matches!(note, Note::NotRead { .. }));
        passed && self.survey.topics.is_empty()
    }
}

/// Looks through a file (`-`: standard input is read once, so it must be a file).
///
/// # Errors
/// It cannot be opened, or nothing of it can be read.
pub fn look(path: &Path, dbc: Option<&Path>) -> Result<Look, LogError> {
    let name = path.display().to_string();
    let refuse = |problem| LogError::new(&name, None, None, problem);
    let database = dbc.map(dbc::load).transpose().map_err(refuse)?;
    let files = folder::files(path).map_err(refuse)?;
    let path = &files[0];
    let mut input = Input::open(path).map_err(refuse)?;
    if let Some(unread) = input.unread() {
        return Err(refuse(Problem::Unread { what: unread.what, remedy: unread.remedy }));
    }
    let (format, is_text) = (input.format(), input.is_text());
    let mut survey = Survey::default();
    let mut all = Continued::new(&mut survey);
    for (k, file) in files.iter().enumerate() {
        if k > 0 {
            input = Input::open(file).map_err(refuse)?;
        }
        all.next_file();
        input.read_all(database.as_ref(), &mut all).map_err(refuse)?;
    }
    let mut own = Vec::new();
    let mut proposal = if is_text {
        let table = Table::open(Input::open(path).map_err(refuse)?, &|_| false)
            .map_err(|cause| refuse(Problem::Unreadable { format: format.name(), cause: cause.into() }))?;
        let head = table.head();
        own.extend(head.names.iter().filter(|name| unit::channel(name).is_some()).cloned());
        of_text(head, &|name| own.iter().any(|own| unit::channel(own) == unit::channel(name)))
    } else {
        of_topics(&survey.topics, &|_| false, &[])
    };
    let rests = |pick: &Pick| {
        let fields =
            survey.topics.iter().flat_map(|of| of.topic.fields.iter().zip(&of.fields).map(move |both| (of, both)));
        let mut own = fields.filter(|(of, (field, _))| of.topic.channel(field) == pick.channel);
        own.any(|(_, (_, range))| range.values > 1 && range.low == range.high)
    };
    // What shows no motion is no reference; an orientation about one axis has parts that stay as they are.
    let is_still = |pick: &Pick| pick.name.starts_with("ref_") && !pick.name.starts_with("ref_q") && rests(pick);
    proposal.chosen.retain(|pick| !is_still(pick));
    proposal.offered.retain(|pick| !is_still(pick));
    let advice = advice(path, dbc).filter(|_| is_text);
    if let Some(advice) = &advice {
        let is_open = |pick: &Pick| !advice.flags.iter().any(|flag| names_the_same(flag, &pick.name));
        proposal.chosen.retain(is_open);
        proposal.offered.retain(is_open);
    }
    Ok(Look { format: format.name(), survey, own, proposal, advice })
}

/// What reading it as a log says that is lacking.
fn advice(path: &Path, dbc: Option<&Path>) -> Option<Advice> {
    let options = Options { dbc: dbc.map(Path::to_owned), needs_reference: true, ..Options::default() };
    let refused = super::read(path, &options).err()?;
    refused.advice.clone().filter(|advice| !advice.flags.is_empty() && advice.left_out.is_empty())
}

/// Whether `NAME=CHANNEL` gives the channel of a name, in any unit.
fn names_the_same(flag: &str, name: &str) -> bool {
    let own = flag.split('=').next().and_then(unit::channel);
    own.is_some() && own == unit::channel(name)
}
