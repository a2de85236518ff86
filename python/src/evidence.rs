//! What logs say, without the logs; and what many of them say together.

use crate::{Answer, Log, Model, refused, watched::watched};
use pyo3::{prelude::*, types::PyBytes};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};
use workbench::{
    evidence::{self, Labels, LogEvidence},
    fleet::{self, type_file},
    output,
    report::{Format, Terminal},
};

/// Evidence of one log or many.
#[pyclass(frozen, module = "truerate._truerate")]
pub(crate) struct Evidence {
    own: evidence::Evidence,
}

#[pymethods]
impl Evidence {
    /// Of a log, with what its maker says of it.
    #[staticmethod]
    #[pyo3(signature = (log, part=None, kind=None, meta=BTreeMap::new(), model=None))]
    fn of(
        py: Python<'_>,
        log: PyRef<'_, Log>,
        part: Option<String>,
        kind: Option<String>,
        meta: BTreeMap<String, String>,
        model: Option<Model>,
    ) -> PyResult<Self> {
        let log = log.clone();
        let labels = Labels { part, kind, meta };
        watched(py, None, move |options| {
            let own = LogEvidence::of(&log.subject, &log.start(model)?, &labels, options)?;
            Ok(Self { own: evidence::Evidence::new([own])? })
        })
    }

    /// Of a file's bytes; `name` is only named in errors.
    #[staticmethod]
    fn parse(name: &str, bytes: &[u8]) -> PyResult<Self> {
        let text = String::from_utf8_lossy(bytes);
        evidence::Evidence::parse(name, &text).map(|own| Self { own }).map_err(refused)
    }

    /// Of a file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        evidence::Evidence::read(&path).map(|own| Self { own }).map_err(refused)
    }

    /// Several together, and how many logs came more than once; `names` are only named in errors.
    #[staticmethod]
    fn merge(py: Python<'_>, all: Vec<Py<Self>>, names: Vec<String>) -> PyResult<(Self, usize)> {
        let all: Vec<evidence::Evidence> = all.iter().map(|one| one.get().own.clone()).collect();
        py.detach(|| evidence::Evidence::merge_named(all.into_iter().zip(names.iter().map(String::as_str))))
            .map(|(own, twice)| (Self { own }, twice))
            .map_err(refused)
    }

    /// The bytes of the file.
    fn bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let text = py.detach(|| self.own.render()).map_err(refused)?;
        Ok(PyBytes::new(py, text.as_bytes()))
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        let text = self.own.render().map_err(refused)?;
        output::write(&path, text.as_bytes()).map_err(refused)
    }

    /// Why logs say nothing of a fleet: name and reason.
    fn left_out(&self) -> Vec<(String, String)> {
        self.own.logs.iter().filter_map(|log| log.left_out().map(|why| (log.log.clone(), why))).collect()
    }

    fn __len__(&self) -> usize {
        self.own.logs.len()
    }
}

/// Types and parts.
#[pyclass(frozen, module = "truerate._truerate")]
pub(crate) struct Fleet {
    own: fleet::Fleet,
    name: String,
}

#[pymethods]
impl Fleet {
    #[new]
    fn new(py: Python<'_>, evidence: &Evidence, name: String) -> Self {
        let own = py.detach(|| fleet::Fleet::of(&evidence.own));
        Self { own, name }
    }

    fn answer(&self) -> Answer {
        let form = |format| self.own.render(&self.name, format, Terminal::PLAIN);
        Answer::new(form(Format::Json), form(Format::Text), form(Format::Html), None, None)
    }

    /// The text of the type file.
    fn types(&self) -> String {
        type_file::render(&self.own)
    }

    fn save_types(&self, path: PathBuf) -> PyResult<()> {
        let path: &Path = &path;
        output::write(path, self.types().as_bytes()).map_err(refused)
    }
}
