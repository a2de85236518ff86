"""The compiled part of truerate. Its classes stand behind those of the package."""

from collections.abc import Callable
from pathlib import Path
from typing import TypedDict

class Reading(TypedDict):
    """How a log is read: the flags of the program under the same names."""

    map: list[str]
    columns: Path | None
    reference: Path | None
    dbc: Path | None

__version__: str

class Error(ValueError):
    """A log, a model or an argument that cannot be used: what was found, where, and what to do about it."""

class Answer:
    json: str
    text: str
    html: str
    explanations: tuple[str, str]
    model: Model | None
    def __init__(
        self, json: str, text: str, html: str, model: Model | None, explanations: tuple[str, str] | None = None
    ) -> None: ...

class Model:
    @staticmethod
    def of(text: str) -> Model: ...
    def text(self) -> str: ...
    def save(self, path: Path) -> None: ...
    def terms(self) -> list[tuple[str, str, str, float, str]]: ...
    def export(
        self,
        format: str,
        name: str,
        rate: float | None = None,
        topic: str = "/imu/data",
        sensor: int = 1,
        chip: str | None = None,
    ) -> tuple[str, list[str]]: ...
    def apply(self, log: Path, options: Reading) -> tuple[list[str], bytes, list[str]]: ...

class Log:
    axes: list[str]
    name: str
    faults: list[tuple[str, int, float | None, str]]
    about: list[str]
    def __init__(
        self,
        path: Path,
        name: str,
        options: Reading,
        axis: str | None = None,
        at_rest: bool = False,
        reference_is_dependent: bool = False,
    ) -> None: ...
    def __len__(self) -> int: ...
    def columns(self) -> list[tuple[str, bytes]]: ...
    def fit(self, model: Model | None = None, prior: tuple[Path, str | None] | None = None) -> Answer: ...
    def add(self, effects: list[str], model: Model | None = None) -> Answer: ...
    def remove(self, effects: list[str], model: Model | None = None) -> Answer: ...
    def compare(self, model: Model | None = None) -> Answer: ...
    def side_by_side(
        self, other: Log, names: tuple[str, str], model: Model | None = None, against: Model | None = None
    ) -> Answer: ...
    def diagnose(
        self,
        model: Model | None = None,
        explain: bool = False,
        progress: Callable[[str], object] | None = None,
        prior: tuple[Path, str | None] | None = None,
    ) -> Answer: ...
    def ladder(
        self,
        model: Model | None = None,
        explain: bool = False,
        progress: Callable[[str], object] | None = None,
        prior: tuple[Path, str | None] | None = None,
    ) -> Answer: ...

class Logs:
    def __init__(self, logs: list[Log], names: list[str]) -> None: ...
    def fit(self, model: Model | None = None) -> Answer: ...
    def compare(self, model: Model | None = None) -> Answer: ...
    def diagnose(
        self, model: Model | None = None, explain: bool = False, progress: Callable[[str], object] | None = None
    ) -> Answer: ...
    def ladder(
        self, model: Model | None = None, explain: bool = False, progress: Callable[[str], object] | None = None
    ) -> Answer: ...

class Evidence:
    @staticmethod
    def of(
        log: Log,
        part: str | None = None,
        kind: str | None = None,
        meta: dict[str, str] = ...,
        model: Model | None = None,
    ) -> Evidence: ...
    @staticmethod
    def parse(name: str, bytes: bytes) -> Evidence: ...
    @staticmethod
    def read(path: Path) -> Evidence: ...
    @staticmethod
    def merge(all: list[Evidence], names: list[str]) -> tuple[Evidence, int]: ...
    def bytes(self) -> bytes: ...
    def save(self, path: Path) -> None: ...
    def left_out(self) -> list[tuple[str, str]]: ...
    def __len__(self) -> int: ...

class Fleet:
    def __init__(self, evidence: Evidence, name: str) -> None: ...
    def answer(self) -> Answer: ...
    def types(self) -> str: ...
    def save_types(self, path: Path) -> None: ...

def load(path: Path) -> Model: ...
def catalogue() -> list[tuple[str, str, list[tuple[str, str]]]]: ...
def simulate(
    path: Path, hide: list[str], motion: str, seconds: float, rate_hz: float, seed: int, axis: str
) -> Model: ...
