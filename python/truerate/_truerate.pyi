"""The compiled part of truerate. Its classes stand behind those of the package."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

__version__: str

class Error(ValueError):
    """A log, a model or an argument that cannot be used: what was found, where, and what to do about it."""

class Answer:
    json: str
    text: str
    html: str
    model: Model | None

class Model:
    def text(self) -> str: ...
    def save(self, path: Path) -> None: ...
    def terms(self) -> list[tuple[str, str, str, float, str]]: ...
    def export(
        self, format: str, name: str, rate: float | None = None, topic: str = "/imu/data", sensor: int = 1
    ) -> tuple[str, list[str]]: ...
    def apply(self, log: Path, options: dict[str, Any]) -> tuple[list[str], bytes]: ...

class Log:
    axes: list[str]
    name: str
    faults: list[tuple[str, int, float | None, str]]
    about: list[str]
    def __init__(
        self,
        path: Path,
        name: str,
        options: dict[str, Any],
        axis: str | None = None,
        at_rest: bool = False,
        reference_is_dependent: bool = False,
    ) -> None: ...
    def __len__(self) -> int: ...
    def columns(self) -> list[tuple[str, bytes]]: ...
    def fit(self, model: Model | None = None) -> Answer: ...
    def compare(self, model: Model | None = None) -> Answer: ...
    def diagnose(
        self, model: Model | None = None, explain: bool = False, progress: Callable[[str], object] | None = None
    ) -> Answer: ...
    def ladder(
        self, model: Model | None = None, explain: bool = False, progress: Callable[[str], object] | None = None
    ) -> Answer: ...

def load(path: Path) -> Model: ...
def catalogue() -> list[tuple[str, str, list[tuple[str, str]]]]: ...
def simulate(
    path: Path, hide: list[str], motion: str, seconds: float, rate_hz: float, seed: int, axis: str
) -> Model: ...
