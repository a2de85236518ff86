"""Many logs: of one sensor together, as evidence that merges, as a fleet."""

from __future__ import annotations

import html as _html
import inspect
import json
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from . import _truerate
from ._logs import Axis, Log, Model, Result, _axis, _framed, _inner, _object, _PathLike, read
from ._tables import Tabular

if TYPE_CHECKING:
    import pandas
    import polars


#: Keyword arguments of :func:`read`.
_READING = frozenset(name for name, own in inspect.signature(read).parameters.items() if own.kind is own.KEYWORD_ONLY)


def _log(source: Any, reading: Mapping[str, Any], called: str) -> Log:
    wrong = [name for name in reading if name not in _READING]
    if wrong:
        raise TypeError(f"{called}() got an unexpected keyword argument {wrong[0]!r}")
    if not isinstance(source, Log):
        return read(source, **reading)
    if reading:
        raise TypeError(f"{', '.join(reading)}: the log has been read already: give it to truerate.read")
    return source


def _logs(logs: Iterable[Any], reading: Mapping[str, Any], called: str) -> _truerate.Logs:
    if isinstance(logs, (str, bytes, Mapping, Log)) or not isinstance(logs, Iterable):
        raise TypeError("several logs are a list; one log is truerate.read(log)")
    if "name" in reading:
        raise TypeError("name: each of several logs has its own: give it to truerate.read")
    own = [_log(log, reading, called) for log in logs]
    # Tables have no names: the place in the list tells them apart.
    names = [log.name if log._is_named else f"{log.name} {place}" for place, log in enumerate(own, 1)]
    return _truerate.Logs([log._inner for log in own], names)


def fit(logs: Iterable[Any], model: Model | None = None, **reading: Any) -> Result:
    """Fits one model to several logs of one sensor: scale factor and bias, or the effects of ``model``.

    ``logs`` are logs, or whatever :func:`read` takes; ``reading`` are its keyword arguments. Each log has a zero, a noise and a
    reference of its own. The result has ``logs``, ``each`` and ``repeats`` beside what a single log gives.

    >>> import truerate
    >>> logs = [truerate.simulate(hide="delay:d=0.012", seconds=60, seed=seed)[0] for seed in (1, 2)]
    >>> together = truerate.diagnose(logs)
    >>> together.verdict, together.repeats[0].effect, together.repeats[0].of
    ('missing-effect', 'delay', 'sensor')
    >>> list(truerate.fit(logs).model.effects["x"])
    ['scale-factor', 'bias']
    """
    return Result(_logs(logs, reading, "fit").fit(_inner(model)))


def compare(logs: Iterable[Any], model: Model | None = None, **reading: Any) -> Result:
    """Holds ``model`` against several logs of one sensor: one error curve over all. Arguments as in :func:`fit`."""
    return Result(_logs(logs, reading, "compare").compare(_inner(model)))


def diagnose(
    logs: Iterable[Any],
    model: Model | None = None,
    *,
    explain: bool = False,
    progress: Callable[[str], object] | None = None,
    **reading: Any,
) -> Result:
    """Finds the effects that several logs of one sensor show together, and those that only some show. Arguments as in :func:`fit`
    and :meth:`Log.diagnose`."""
    return Result(_logs(logs, reading, "diagnose").diagnose(_inner(model), explain, progress))


def ladder(
    logs: Iterable[Any],
    model: Model | None = None,
    *,
    explain: bool = False,
    progress: Callable[[str], object] | None = None,
    **reading: Any,
) -> Result:
    """One model of several logs with what all of them show. Arguments as in :func:`fit` and :meth:`Log.diagnose`."""
    return Result(_logs(logs, reading, "ladder").ladder(_inner(model), explain, progress))


class SideBySide(Tabular):
    """Two sensors side by side. ``axes`` has, by the axis' letter: ``better`` (``"first"``, ``"second"`` or ``None``), ``says``,
    ``quantities`` (``name``, ``unit``, ``values`` and ``std_errors`` of both, ``better``) and ``errors`` (``tau_s``, s; ``errors`` of both,
    rad/s; ``ratio`` of the first to the second, with its band of 95 % from ``low`` to ``high``). ``each`` is what either comes to alone,
    axis by axis; ``logs`` are their names. As a table it has one averaging time a row: axis, tau_s (s), first and second (rad/s), ratio,
    low, high, better."""

    def __init__(self, answer: _truerate.Answer) -> None:
        self._answer = answer
        self._json = json.loads(answer.json)
        self.logs: list[str] = self._json["logs"]
        self.axes: dict[str, SimpleNamespace] = {own["axis"]: _object(own) for own in self._json["axes"]}
        self.each: list[dict[str, Axis]] = [{axis["axis"]: _axis(axis) for axis in own} for own in self._json["each"]]

    def summary(self) -> str:
        """Which is better, by what and over which time, in words and a table."""
        return self._answer.text

    def to_html(self) -> str:
        """The report with both curves: one page that needs nothing else."""
        return self._answer.html

    def to_dict(self) -> dict[str, Any]:
        """The result as the program's JSON has it."""
        return json.loads(self._answer.json)

    def _rows(self) -> list[dict[str, Any]]:
        def row(axis: str, own: dict[str, Any]) -> dict[str, Any]:
            first, second = own["errors"]
            beside = {name: own[name] for name in ("ratio", "low", "high", "better")}
            return {"axis": axis, "tau_s": own["tau_s"], "first": first, "second": second, **beside}

        return [row(axis["axis"], own) for axis in self._json["axes"] for own in axis["errors"]]

    def __reduce__(self) -> Any:
        return _beside, (self._answer.json, self._answer.text, self._answer.html)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        better = ", ".join(f"{letter}: {own.better or 'none'} better" for letter, own in self.axes.items())
        return f"<truerate.SideBySide {self.logs[0]!r}, {self.logs[1]!r}; {better}>"

    def _repr_html_(self) -> str:
        return _framed(self.to_html())


def _beside(json_text: str, text: str, page: str) -> SideBySide:
    """A comparison that comes from another process."""
    return SideBySide(_truerate.Answer(json_text, text, page, None))


def side_by_side(
    first: Any, second: Any, model: Model | None = None, against: Model | None = None, **reading: Any
) -> SideBySide:
    """Sets two sensors beside each other: which is better, by what, and over which time.

    ``first`` and ``second`` are a log of each, or whatever :func:`read` takes, with its keyword arguments as ``reading``. Each has its own
    model: scale factor and bias, fitted to its log, or ``model`` for the first and ``against`` for the second. It is fairest where both
    moved together.

    >>> import truerate
    >>> good, _ = truerate.simulate(seconds=60, seed=1)
    >>> late, _ = truerate.simulate(hide="delay:d=0.012", seconds=60, seed=2)
    >>> truerate.side_by_side(good, late).axes["x"].better
    'first'
    """
    if "name" in reading:
        raise TypeError("name: each log has its own: give it to truerate.read")
    logs = [_log(log, reading, "side_by_side") for log in (first, second)]
    names = tuple(log.name if log._is_named else place for log, place in zip(logs, ("first", "second"), strict=True))
    if names[0] == names[1]:
        names = (f"{names[0]} 1", f"{names[1]} 2")
    return SideBySide(logs[0]._inner.side_by_side(logs[1]._inner, names, _inner(model), _inner(against)))


class Evidence(Tabular):
    """What logs say, without their readings: 20 kB a log of one axis. It is merged, saved, and sent to other processes as it is.

    Made by :func:`evidence` and :func:`merge`; ``Evidence(source)`` reads a file (a path) or its bytes. ``bytes(evidence)`` are those of
    the file, which the program reads and writes. As a table it has one log a row: log, part, type, day, seconds, samples, verdict.
    """

    def __init__(self, source: _PathLike | bytes) -> None:
        if isinstance(source, (bytes, bytearray, memoryview)):
            self._inner = _truerate.Evidence.parse("bytes", bytes(source))
        elif isinstance(source, (str, os.PathLike)):
            self._inner = _truerate.Evidence.read(Path(source))
        else:
            raise TypeError(f"evidence is an object of it, a file's path or its bytes, not {type(source).__name__}")

    @classmethod
    def _of(cls, inner: _truerate.Evidence) -> Evidence:
        own = cls.__new__(cls)
        own._inner = inner
        return own

    @property
    def logs(self) -> list[SimpleNamespace]:
        """Log by log, in the order of the file: ``log``, ``part``, ``type``, ``meta``, ``day``, ``seconds``, ``samples``, ``temperature``
        (lowest and highest, °C), ``axes``; ``pieces`` are the normal equations in SI units, with ``information`` of shape
        (n (n + 1) / 2,) for n ``columns``, and ``score`` of shape (n,)."""
        return _object(json.loads(bytes(self))["logs"])

    @property
    def left_out(self) -> list[tuple[str, str]]:
        """Logs that say nothing of a fleet, and why."""
        return self._inner.left_out()

    def save(self, path: _PathLike) -> None:
        """Writes the evidence file."""
        self._inner.save(Path(path))

    def summary(self) -> str:
        """The logs in a table."""
        rows = [list(map(str, row.values())) for row in self._rows()]
        names = list(self._rows()[0])
        wide = [max(len(row[k]) for row in [names, *rows]) for k in range(len(names))]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, wide, strict=True)).rstrip() for row in [names, *rows]]
        many = f"{len(self)} logs" if len(self) > 1 else "1 log"
        return "\n".join([f"Evidence of {many}, {len(bytes(self)) / 1000:.0f} kB", "", *lines, ""])

    def _rows(self) -> list[dict[str, Any]]:
        def row(log: dict[str, Any]) -> dict[str, Any]:
            own = {name: log[name] for name in ("log", "part", "type", "day", "seconds", "samples")}
            return {**own, "verdict": ", ".join(f"{axis['axis']}: {axis['verdict']}" for axis in log["axes"])}

        return [row(log) for log in json.loads(bytes(self))["logs"]]

    def __bytes__(self) -> bytes:
        return self._inner.bytes()

    def __len__(self) -> int:
        return len(self._inner)

    def __eq__(self, other: object) -> bool:
        return bytes(self) == bytes(other) if isinstance(other, Evidence) else NotImplemented

    def __hash__(self) -> int:
        return hash(bytes(self))

    def __reduce__(self) -> Any:
        return Evidence, (bytes(self),)

    def __repr__(self) -> str:
        return f"<truerate.Evidence: {len(self)} {'logs' if len(self) > 1 else 'log'}>"

    def _repr_html_(self) -> str:
        rows = self._rows()
        head = "".join(f"<th>{_html.escape(name)}</th>" for name in rows[0])
        body = "".join(
            "<tr>" + "".join(f"<td>{_html.escape(str(value))}</td>" for value in row.values()) + "</tr>" for row in rows
        )
        return f"<table><tr>{head}</tr>{body}</table>"


def evidence(
    log: Any,
    *,
    part: str | int | None = None,
    type: str | None = None,  # the flag's name
    meta: Mapping[str, object] | None = None,
    model: Model | None = None,
    **reading: Any,
) -> Evidence:
    """What a log says, without its readings: the normal equations of the model and of every effect, noise, causes of the error.

    Parameters
    ----------
    log
        A :class:`Log`, or whatever :func:`read` takes, with its keyword arguments as ``reading``. A worker of another machine is given
        a path that it can read, or the bytes.
    part
        The part that was recorded: one sensor, by a number or a name. Without it the log's name is the part; a table or bytes have no
        name, and need it.
    type
        The type of the part: sensor, with its driver and range where they matter.
    meta
        Anything else that is known of the recording; ``{"day": "2026-05-31"}`` gives the day where the log has no date.
    model
        The model to start from; without it the base model.

    Examples
    --------
    >>> import truerate
    >>> log, _ = truerate.simulate(seconds=30)
    >>> own = truerate.evidence(log, part=17, type="BMI160")
    >>> own.logs[0].part, len(own)
    ('17', 1)
    >>> truerate.merge([own, own]) == own
    True
    """
    meta = {str(key): str(value) for key, value in (meta or {}).items()}
    own = _log(log, reading, "evidence")
    if part is None and not own._is_named:
        raise _truerate.Error("which part is it? A table or bytes have no name: give part=, the number or name of the sensor")
    part, kind = (None if given is None else str(given) for given in (part, type))
    return Evidence._of(_truerate.Evidence.of(own._inner, part, kind, meta, _inner(model)))


def merge(evidence: Iterable[Evidence | _PathLike | bytes]) -> Evidence:
    """Puts evidence together: objects, files or their bytes. The result depends on the logs alone: any split and any order, on any
    machine, give the same bytes. A log that comes twice counts once.

    Raises
    ------
    Error
        Two pieces of one log that differ, or a file that is damaged; it is named.
    """
    if isinstance(evidence, (str, bytes, bytearray, Evidence)) or not isinstance(evidence, Iterable):
        raise TypeError("what is merged is a list of evidence")
    own, names = [], []
    for place, one in enumerate(evidence, 1):
        own.append(one if isinstance(one, Evidence) else Evidence(one))
        names.append(str(one) if isinstance(one, (str, os.PathLike)) else f"number {place} of the list")
    if not own:
        raise _truerate.Error("no evidence to merge")
    return Evidence._of(_truerate.Evidence.merge([one._inner for one in own], names)[0])


class Fleet:
    """What many logs of many sensors say together.

    Parameters
    ----------
    evidence
        :class:`Evidence`, a file of it, its bytes, or a list of these, which is merged.

    Attributes
    ----------
    types
        Parameter by parameter of each type: ``type``, ``axis``, ``effect``, ``name``, ``unit``, ``mean``, ``std_error``, ``spread`` (standard
        deviation between parts), ``next`` (where the next part lies, 95 %), ``p_value``, ``matters``, ``readings`` (log by log). SI units.
    parts
        Parameter by parameter of each part, outliers first: ``part``, ``effect``, ``value``, ``std_error``, ``outlier``, ``changed`` (``day``,
        ``days``, ``by``).
    labels, faults
        What goes by a label of the logs (driver, lot, mount); faults of the data that are a type's or a part's.
    misaligned
        Pairs of axes that feel each other's rate: ``turned`` is the mount's (rad), ``alike`` the chip's (a share).
    ambiguous, left_out
        Effects that the logs together cannot tell apart; logs that do not count, and why.
    """

    def __init__(self, evidence: Evidence | _PathLike | bytes | Iterable[Evidence | _PathLike | bytes]) -> None:
        name = str(evidence) if isinstance(evidence, (str, Path)) else "evidence"
        if isinstance(evidence, (str, bytes, bytearray, memoryview, os.PathLike)) or not isinstance(evidence, (Evidence, Iterable)):
            evidence = Evidence(evidence)
        self._evidence = evidence if isinstance(evidence, Evidence) else merge(evidence)
        self._inner = _truerate.Fleet(self._evidence._inner, name)
        self._answer = self._inner.answer()
        self._json = json.loads(self._answer.json)
        self.types: list[SimpleNamespace] = _object(self._json["types"])
        self.parts: list[SimpleNamespace] = _object(self._json["parts"])
        self.labels: list[SimpleNamespace] = _object(self._json["labels"])
        self.faults: list[SimpleNamespace] = _object(self._json["faults"])
        self.misaligned: list[SimpleNamespace] = _object(self._json["misaligned"])
        self.ambiguous: list[SimpleNamespace] = _object(self._json["ambiguous"])
        self.left_out: list[SimpleNamespace] = _object(self._json["left_out"])

    @property
    def evidence(self) -> Evidence:
        """What it was made of."""
        return self._evidence

    def summary(self) -> str:
        """Types, parts that are not of their type, and changes in time, in words."""
        return self._answer.text

    def to_html(self) -> str:
        """The report, with forest and caterpillar plots: one page that needs nothing else."""
        return self._answer.html

    def to_dict(self) -> dict[str, Any]:
        """The result as the program's JSON has it."""
        return json.loads(self._answer.json)

    def type_file(self) -> str:
        """The means and spreads of the types, as the text of a type file: what ``prior`` of :meth:`Log.fit` takes."""
        return self._inner.types()

    def save_types(self, path: _PathLike) -> None:
        """Writes that file."""
        self._inner.save_types(Path(path))

    def to_pandas(self, table: str = "types") -> pandas.DataFrame:
        """One of the tables: ``"types"`` (a row for each parameter of a type, with ``next_from`` and ``next_to``), ``"parts"`` (for each
        parameter of a part), ``"readings"`` (for each parameter and log: ``value``, ``std_error``) or ``"changes"`` (for each change of a
        part: ``day``, ``days``, ``by``). SI units; ``unit`` names them."""
        import pandas

        return pandas.DataFrame(self._table(table))

    def to_polars(self, table: str = "types") -> polars.DataFrame:
        """The same as a polars ``DataFrame``."""
        import polars

        return polars.DataFrame(self._table(table))

    def _table(self, table: str) -> list[dict[str, Any]]:
        if table not in ("types", "parts", "readings", "changes"):
            raise ValueError(f"table {table!r}: expected 'types', 'parts', 'readings' or 'changes'")
        inner = {"types": None, "parts": None, "readings": "readings", "changes": "changed"}[table]
        rows = []
        for own in self._json["types" if table in ("types", "readings") else "parts"]:
            flat = {name: value for name, value in own.items() if not isinstance(value, list) and name != "next"}
            if inner is not None:
                keys = ("type", "part", "axis", "effect", "name", "unit")
                labels = {name: flat[name] for name in keys if name in flat}
                rows += [{**labels, **one} for one in own[inner]]
            elif table == "types":
                low, high = own["next"] or (None, None)
                rows.append({**flat, "next_from": low, "next_to": high})
            else:
                rows.append({**flat, "changes": len(own["changed"])})
        return rows

    def __reduce__(self) -> Any:
        return Fleet, (self._evidence,)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        outliers = len({(part.type, part.part) for part in self.parts if part.outlier})
        return f"<truerate.Fleet: {self._json['logs']} logs of {self._json['part_count']} parts, {outliers} not of their type>"

    def _repr_html_(self) -> str:
        return _framed(self.to_html())
