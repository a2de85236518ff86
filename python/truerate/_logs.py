"""Logs, results and models."""

from __future__ import annotations

import csv
import html as _html
import json
import keyword
import os
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol, Union

import numpy as np

from . import _truerate
from ._tables import Tabular
from ._truerate import Error

if TYPE_CHECKING:
    import pandas
    import polars

_PathLike = Union[str, "os.PathLike[str]"]


class _OfOneType(Protocol):
    """What a new part may begin with: a ``Fleet`` of one type."""

    def type_file(self) -> str: ...


def _columns(source: Any, mapped: Iterable[str] = ()) -> dict[str, np.ndarray] | None:
    """The columns of a table: of a mapping, a pandas, polars or pyarrow table; ``None`` where it is not a table. ``mapped`` are the
    channels that the caller names."""
    for method, kind in (("collect", "LazyFrame"), ("compute", "DataFrame")):
        if hasattr(source, method) and hasattr(type(source), "columns") and not hasattr(source, "fetchnumpy"):
            raise TypeError(f"this {kind} has not been computed yet: give its .{method}()")
    if hasattr(source, "to_frame") and not hasattr(source, "columns"):
        raise TypeError(f"a log is a table with a time and readings, and this is one column ({type(source).__name__})")
    index = {}
    if isinstance(source, Mapping):
        pairs = list(source.items())
    elif hasattr(source, "fetchnumpy"):  # DuckDB
        pairs = list(source.fetchnumpy().items())
    elif hasattr(source, "column_names") and hasattr(source, "column"):  # pyarrow
        pairs = [(name, source.column(name).to_numpy()) for name in source.column_names]
    elif hasattr(source, "columns") and hasattr(source, "__getitem__"):  # pandas, polars
        names = list(source.columns)
        _named(names)
        pairs = [(name, source[name].to_numpy()) for name in names]
        index = _time_of_index(source, [*names, *mapped])
    elif hasattr(source, "__arrow_c_stream__"):  # anything else that speaks Arrow
        import pyarrow

        return _columns(pyarrow.table(source), mapped)
    else:
        return None
    _named([name for name, _ in pairs])
    columns = {**index, **{str(name): np.asarray(values) for name, values in pairs}}
    for name, values in columns.items():
        if values.ndim != 1:
            found = "one value" if values.ndim == 0 else f"an array of {values.ndim} dimensions"
            raise Error(f"column {name!r} is {found}: give an array with a value for each row")
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise Error(f"the columns have different lengths: {lengths}")
    if not columns or not next(iter(lengths.values())):
        raise Error("the table has no rows")
    return columns


def _named(names: list[Any]) -> None:
    """Refuses columns that a log cannot have."""
    if any(isinstance(name, (int, np.integer)) for name in names):
        numbers = ", ".join(map(str, names[:4]))
        raise Error(
            f"the columns have numbers for names ({numbers}), which do not say what is in them: name them, with their units, as in "
            "df.columns = ['t', 'gyro_z_dps', 'ref_angle_z_deg']"
        )
    twice = sorted({str(name) for name in names if names.count(name) > 1})
    if twice:
        raise Error(f"two columns are named {twice[0]!r}: rename one of them")


def _is_time(name: Any) -> bool:
    return str(name) == "t" or str(name).startswith("t_")


def _time_of_index(table: Any, names: list[Any]) -> dict[str, np.ndarray]:
    """The time of a pandas frame whose index is one: of dates, of durations, or named ``t`` or ``time``. Nothing where a column has it."""
    index = getattr(table, "index", None)
    if index is None or not hasattr(index, "dtype") or any(_is_time(name) for name in names):
        return {}
    kind = type(index).__name__
    if kind in ("DatetimeIndex", "TimedeltaIndex"):
        unit = "datetime64[ns]" if kind == "DatetimeIndex" else "timedelta64[ns]"
        return {"t_ns": index.to_numpy(dtype=unit)}
    name = index.name
    if isinstance(name, str) and (_is_time(name) or name == "time") and index.dtype.kind in "iuf":
        return {name if _is_time(name) else "t": index.to_numpy()}
    return {}


def _cell(value: Any) -> str:
    if value is None or value != value:  # missing, or NaN
        return ""
    if isinstance(value, float):
        return repr(value)
    return str(value)


def _written(columns: dict[str, np.ndarray], path: Path) -> None:
    """Writes a table as the reader's own text: a double keeps every bit."""
    lists, names = [], []
    for name, values in columns.items():
        if values.dtype.kind in "Mm":
            if np.isnat(values).any():
                raise Error(f"column {name!r}: row {int(np.argmax(np.isnat(values)))} has no time (NaT): drop such rows")
            values = values.astype(f"{'datetime' if values.dtype.kind == 'M' else 'timedelta'}64[ns]").astype(np.int64)
            # It has its unit, whatever its name says.
            name = "t_ns" if _is_time(name) else name
        elif values.dtype.kind == "b":
            values = values.astype(np.int8)
        elif values.dtype.kind == "f":
            values = values.astype(np.float64)
        elif values.dtype.kind not in "iuUO":
            raise Error(f"column {name!r}: numbers are needed, this is {values.dtype}")
        lists.append(values.tolist())
        names.append(name)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([_cell(value) for value in row] for row in zip(*lists, strict=True))


def _maps(names: Mapping[str, str] | Iterable[str] | None) -> list[str]:
    if names is None:
        return []
    if isinstance(names, Mapping):
        return [f"{name}={channel}" for name, channel in names.items()]
    if isinstance(names, str):
        return [names]
    if not isinstance(names, Iterable):
        raise TypeError(f"map: expected a dict of names, or a list of 'NAME=CHANNEL', not {type(names).__name__}")
    return list(names)


class _Source:
    """A log as a file: what came as bytes or as a table is written to one for as long as it is read."""

    def __init__(self, source: Any, maps: Iterable[str] = (), name: str | None = None) -> None:
        self._folder: tempfile.TemporaryDirectory | None = None
        # Whether the name is one that the caller knows the log by.
        self.is_named = name is not None or isinstance(source, (str, os.PathLike))
        if isinstance(source, (str, os.PathLike)):
            self.path, self.name = Path(source), name or str(source)
            return
        self._folder = tempfile.TemporaryDirectory(prefix="truerate-")
        self.path = Path(self._folder.name, "log")
        if isinstance(source, (bytes, bytearray, memoryview)):
            self.path.write_bytes(source)
            self.name = name or "bytes"
            return
        if hasattr(source, "read") and not hasattr(source, "columns"):
            try:
                self._read(source, name)
            except BaseException:
                self._folder.cleanup()
                raise
            return
        try:
            columns = _columns(source, [own.split("=")[0] for own in maps])
        except BaseException:
            self._folder.cleanup()
            raise
        if columns is None:
            self._folder.cleanup()
            kind = type(source).__name__
            raise TypeError(f"a log is a path, bytes, a file that is open, a table or a mapping of arrays, not {kind}")
        self.path = self.path.with_suffix(".csv")
        _written(columns, self.path)
        self.name = name or "table"

    def _read(self, source: Any, name: str | None) -> None:
        """Takes what is left of a file that is open, as bytes or as text."""
        content = source.read()
        if not isinstance(content, (str, bytes, bytearray)):
            raise TypeError(f"a file that is open gives bytes or text; this one gave {type(content).__name__}")
        self.path.write_bytes(content.encode() if isinstance(content, str) else content)
        own = getattr(source, "name", None)
        own = own if isinstance(own, (str, os.PathLike)) else None
        self.is_named = self.is_named or own is not None
        self.name = name or (str(own) if own is not None else "text" if isinstance(content, str) else "bytes")

    def __enter__(self) -> _Source:
        return self

    def __exit__(self, *_: object) -> None:
        if self._folder is not None:
            self._folder.cleanup()


def _said(error: Error, source: _Source) -> Error:
    """The same error with the name that the caller knows."""
    return Error(str(error).replace(str(source.path), source.name))


def read(
    source: Any,
    *,
    map: Mapping[str, str] | Iterable[str] | None = None,  # the flag's name
    reference: Any = None,
    columns: _PathLike | None = None,
    dbc: _PathLike | None = None,
    axis: str | None = None,
    at_rest: bool = False,
    reference_is_dependent: bool = False,
    name: str | None = None,
) -> Log:
    """Reads a log.

    Parameters
    ----------
    source
        A path (CSV or other text, Parquet, ULog, MCAP, …; packed or not), the bytes of such a file, a file that is open (binary or
        text; it is read from where it stands), a pandas, polars or pyarrow table, a DuckDB result, anything with Arrow's C stream, or a mapping of names to arrays of one length. An index of a
        pandas frame is the time where no column is and it holds dates or durations, or is named ``t`` or ``time`` (s).
    map
        Channels under the names of the format: ``{"gyro_z_dps": "0.1*raw_z+2"}`` or ``["gyro_z=imu.gz"]``.
    reference
        A second log that the reference is taken from, of any of these kinds; it is joined in time.
    columns
        A TOML file that renames foreign headers.
    dbc
        A DBC file: what the frames of a CAN log mean.
    axis
        ``"x"``, ``"y"`` or ``"z"``: only this axis. All axes that have a gyro and a reference otherwise.
    at_rest
        An axis without a reference did not turn, because the sensor was at rest or on a turntable of another axis: it is
        judged against zero rate.
    reference_is_dependent
        Use the reference although it was computed from this very gyro.
    name
        What the log is called in results, of a table or bytes: these have no name of their own.

    Raises
    ------
    Error
        The log cannot be used: what was found, where, and what to do about it.

    Examples
    --------
    >>> import numpy as np, truerate
    >>> t = np.arange(0, 20, 0.01)
    >>> angle = np.sin(t)
    >>> noise = 1e-3 * np.random.default_rng(1).standard_normal(t.size)
    >>> log = truerate.read({"t": t, "gyro_z": 1.02 * np.cos(t) + 0.01 + noise, "ref_angle_z": angle})
    >>> log.axes
    ['z']
    """
    reading = {
        "map": _maps(map),
        "columns": None if columns is None else Path(columns),
        "dbc": None if dbc is None else Path(dbc),
    }
    with _Source(source, reading["map"], name) as file, nullcontext() if reference is None else _Source(reference) as second:
        reading["reference"] = None if second is None else second.path
        try:
            inner = _truerate.Log(file.path, file.name, reading, axis, at_rest, reference_is_dependent)
        except Error as error:
            for named in (file, second):
                error = error if named is None else _said(error, named)
            raise error from None
    return Log(inner, file.is_named)


class Log:
    """A log that has been read: rows, faults of its data, the axes that are worked on. Made by :func:`read`."""

    def __init__(self, inner: _truerate.Log, is_named: bool = True) -> None:
        self._inner = inner
        self._is_named = is_named

    @property
    def name(self) -> str:
        """The log as it was named."""
        return self._inner.name

    @property
    def axes(self) -> list[str]:
        """The axes that have a gyro and a reference."""
        return self._inner.axes

    @property
    def data_faults(self) -> list[DataFault]:
        """What is faulty in the data: ``fault``, ``count``, ``first_t`` (s) and ``says`` of each."""
        names = ("fault", "count", "first_t", "says")
        return [DataFault(**dict(zip(names, fault, strict=True))) for fault in self._inner.faults]

    def to_numpy(self) -> dict[str, np.ndarray]:
        """Times, s, and the readings of each gyro axis, rad/s; NaN where there is no reading. Shapes: (rows,)."""
        return {name: np.frombuffer(values, "<f8") for name, values in self._inner.columns()}

    def to_pandas(self) -> pandas.DataFrame:
        """The same as a pandas ``DataFrame``."""
        import pandas

        return pandas.DataFrame(self.to_numpy())

    def to_polars(self) -> polars.DataFrame:
        """The same as a polars ``DataFrame``."""
        import polars

        return polars.DataFrame(self.to_numpy())

    def fit(self, model: Model | None = None, *, prior: _PathLike | _OfOneType | None = None) -> Result:
        """Fits the scale factor and the bias of each axis, or the effects of ``model``.

        ``prior`` is a type that the part is of: a type file (``"type.toml"``, or ``"type.toml:BMI160"`` where it holds several) or a
        :class:`Fleet` of one type. A new part then needs seconds. What is not of the type is said, and not pulled to it.
        """
        return Result(self._inner.fit(_inner(model), _type(prior, model)))

    def add(self, effects: str | Iterable[str], model: Model | None = None) -> Result:
        """Adds effects to ``model`` (the base model without one) on every axis, and fits both to the log.

        The result is that of the new model, ``.model``; ``before`` are the axes without the effects, ``added`` their ids.

        >>> import truerate
        >>> log, _ = truerate.simulate(hide="delay:d=0.012", seconds=60)
        >>> late = log.add("delay")
        >>> late.added, late.before[0].verdict, late.verdict
        (['delay'], 'unexplained', 'adequate')
        >>> late.before[0].error_over_floor > 10 * late.error_over_floor
        True
        """
        return Result(self._inner.add(_listed(effects), _inner(model)))

    def remove(self, effects: str | Iterable[str], model: Model) -> Result:
        """The same of a model without these effects; ``removed`` are their ids."""
        return Result(self._inner.remove(_listed(effects), _inner(model)))

    def compare(self, model: Model | None = None) -> Result:
        """Compares ``model`` with the log. Without a model, the base model (scale factor and bias) is fitted first."""
        return Result(self._inner.compare(_inner(model)))

    def diagnose(
        self,
        model: Model | None = None,
        *,
        explain: bool = False,
        progress: Callable[[str], object] | None = None,
        prior: _PathLike | _OfOneType | None = None,
    ) -> Result:
        """Finds the physical effects that ``model`` lacks. Without a model, the base model is fitted first.

        ``progress`` is called with a text, on the thread that called this method. An exception that it raises, or Ctrl-C, ends
        the search. An axis that cannot be judged gives a ``RuntimeWarning``; the others go on. ``prior`` as in :meth:`fit`. With
        ``explain`` the result tells why each effect was named or was not (:meth:`Result.explain`).
        """
        return Result(self._inner.diagnose(_inner(model), explain, progress, _type(prior, model)))

    def ladder(
        self,
        model: Model | None = None,
        *,
        explain: bool = False,
        progress: Callable[[str], object] | None = None,
        prior: _PathLike | _OfOneType | None = None,
    ) -> Result:
        """Adds what is missing until nothing is; ``.model`` of the result is the final model. ``prior`` as in :meth:`fit`."""
        return Result(self._inner.ladder(_inner(model), explain, progress, _type(prior, model)))

    def __len__(self) -> int:
        return len(self._inner)

    def __reduce__(self) -> Any:
        raise TypeError(
            "a log that has been read is not sent to another process: send its path, or its bytes, and read it there"
        )

    def __repr__(self) -> str:
        return f"<truerate.Log {self.name!r}: {', '.join(self._inner.about[:2])}, axes {' '.join(self.axes)}>"


def _listed(effects: str | Iterable[str]) -> list[str]:
    return [effects] if isinstance(effects, str) else list(effects)


def _inner(model: Model | None) -> _truerate.Model | None:
    if model is None or isinstance(model, Model):
        return None if model is None else model._inner
    raise TypeError(f"model: expected a truerate.Model, not {type(model).__name__}")


def _type(prior: Any, model: Model | None) -> tuple[Path, str | None] | None:
    """A type file, or the text that one would have."""
    if prior is None:
        return None
    if model is not None:
        raise TypeError("give a model or a prior, not both")
    if isinstance(prior, (str, os.PathLike)):
        return Path(prior), None
    if hasattr(prior, "type_file"):
        return Path("fleet"), prior.type_file()
    raise TypeError(f"prior: expected a path or a truerate.Fleet, not {type(prior).__name__}")


def _object(value: Any, kind: type[SimpleNamespace] | None = None) -> Any:
    """JSON with its names as attributes; a name that is a word of Python's ends in an underscore, as in ``from_``."""
    if isinstance(value, dict):
        own = {_attribute(name): _object(inner, _KINDS.get(name)) for name, inner in value.items()}
        return (kind or SimpleNamespace)(**own)
    return [_object(inner, kind) for inner in value] if isinstance(value, list) else value


def _attribute(name: str) -> str:
    return f"{name}_" if keyword.iskeyword(name) else name


class Parameter(SimpleNamespace):
    """A parameter of an effect, in SI units."""

    effect: str
    name: str
    value: float | None
    std_error: float | None
    unit: str


class ErrorPoint(SimpleNamespace):
    """The error over the averaging time ``tau_s`` (s), on data that the fit did not use, beside what noise alone would leave; rad/s."""

    tau_s: float
    error: float | None
    floor: float | None
    floor_99: float | None


class Suspect(SimpleNamespace):
    """An effect that may be missing. ``error_fall`` is the share of the error that it removes."""

    effect: str
    aliases: list[str]
    separate_by: str | None
    p_value: float | None
    error_fall: float | None
    parameters: list[Parameter]
    error_curve: list[ErrorPoint]


class Budget(SimpleNamespace):
    """What the error over ``tau_s`` (s) is made of: mean squares, (rad/s)², that add up to the square of the error."""

    tau_s: float
    gyro_noise: float | None
    bias_wander: float | None
    reference_noise: float | None
    reference_bandwidth: float | None
    timing: float | None
    folded_motion: float | None
    missing: float | None
    random_scale: float | None
    rate_noise: float | None
    reversal_steps: float | None
    start_stop_steps: float | None
    lost_motion: float | None
    unattributed: float | None


class DataFault(SimpleNamespace):
    """A fault of the data: how often, first when (s), and in words."""

    fault: str
    count: int
    first_t: float | None
    says: str


#: What stands in lists of these names.
_KINDS: dict[str, type[SimpleNamespace]] = {
    "parameters": Parameter,
    "error_curve": ErrorPoint,
    "suspects": Suspect,
    "budget": Budget,
    "data_faults": DataFault,
}


class Axis(SimpleNamespace):
    """What was found on one axis, under the names that the JSON of the program has. ``random`` and ``explained`` are empty lists where
    there is nothing. Rates are in rad/s, times in s."""

    axis: str
    verdict: str
    headline: str
    finding: SimpleNamespace
    effects: list[str]
    parameters: list[Parameter]
    noise: SimpleNamespace
    error_curve: list[ErrorPoint]
    error_over_floor: float | None
    within_floor: bool
    suspects: list[Suspect]
    budget: list[Budget]
    limited_by: str | None
    limited_says: str
    data_faults: list[DataFault]
    fails_where: list[SimpleNamespace]
    random: list[SimpleNamespace] = []
    explained: list[SimpleNamespace] = []


def _axis(own: Mapping[str, Any]) -> Axis:
    return Axis(**{_attribute(name): _object(value, _KINDS.get(name)) for name, value in own.items()})


#: What a result has of all axes together.
_OF_WHOLE = ("logs", "each", "repeats", "added", "removed", "before")


class Result(Tabular):
    """What was found on a log. ``axes`` has it axis by axis. Attributes of a single axis (``verdict``, ``headline``, ``suspects``,
    ``budget``, … of :class:`Axis`) stand here, too; of several axes each is a dict by the axis' letter. Of several logs there are
    ``logs`` (names), ``each`` (log by log) and ``repeats`` (effect by effect: whose it is). As a table (``to_pandas``,
    ``pyarrow.table(result)``, a query of DuckDB) it has one parameter a row: axis, effect, name, value, std_error, unit."""

    def __init__(self, answer: _truerate.Answer) -> None:
        self._answer = answer
        self._json = json.loads(answer.json)
        self.axes: dict[str, Axis] = {axis["axis"]: _axis(axis) for axis in self._json["axes"]}

    def __getattr__(self, name: str) -> Any:
        axes, whole = self.__dict__.get("axes", {}), self.__dict__.get("_json", {})
        if name in _OF_WHOLE and name in whole:
            return _object(whole[name])
        values = {letter: getattr(axis, name) for letter, axis in axes.items() if hasattr(axis, name)}
        if not values:
            raise AttributeError(f"a result has no {name!r}")
        return next(iter(values.values())) if len(axes) == 1 else values

    def __dir__(self) -> list[str]:
        of_axes = {name for axis in self.axes.values() for name in vars(axis)}
        return sorted({*super().__dir__(), *of_axes, *(name for name in _OF_WHOLE if name in self._json)})

    def explain(self, full: bool = False) -> str:
        """Why each effect was named or was not, in a sentence each; with ``full``, each test with its numbers.

        >>> import truerate
        >>> log, _ = truerate.simulate(hide="delay:d=0.012", seconds=60)
        >>> found = log.diagnose(explain=True)
        >>> "delay" in found.explain(), len(found.explain(full=True)) > len(found.explain())
        (True, True)
        """
        short, long = self._answer.explanations
        if not short:
            raise Error("the tests of each effect were not kept: give explain=True to diagnose or ladder")
        return long if full else short

    @property
    def model(self) -> Model | None:
        """The model that was compared, or made."""
        inner = self._answer.model
        return None if inner is None else Model(inner)

    def summary(self) -> str:
        """The result in words, with its tables."""
        return self._answer.text

    def to_html(self) -> str:
        """The report: one page that needs nothing else."""
        return self._answer.html

    def to_dict(self) -> dict:
        """The result as the program's JSON has it."""
        return json.loads(self._answer.json)

    def _rows(self) -> list[dict[str, Any]]:
        return [{"axis": axis["axis"], **own} for axis in self._json["axes"] for own in axis["parameters"]]

    def __str__(self) -> str:
        return self.summary()

    def __reduce__(self) -> Any:
        own, model = self._answer, self.model
        return _result, (own.json, own.text, own.html, None if model is None else str(model), own.explanations)

    def __repr__(self) -> str:
        return "<truerate.Result " + ", ".join(f"{letter}: {axis.verdict}" for letter, axis in self.axes.items()) + ">"

    def _repr_html_(self) -> str:
        return _framed(self.to_html())


def _framed(page: str) -> str:
    """A page inside a notebook: it reaches nothing outside of it."""
    page = _html.escape(page, quote=True)
    return f'<iframe sandbox="allow-scripts" srcdoc="{page}" style="width:100%;height:40em;border:0"></iframe>'


def _result(json_text: str, text: str, page: str, model: str | None, explanations: tuple[str, str]) -> Result:
    """A result that comes from another process."""
    own = None if model is None else _truerate.Model.of(model)
    return Result(_truerate.Answer(json_text, text, page, own, explanations))


def _model(text: str) -> Model:
    """A model that comes from another process."""
    return Model(_truerate.Model.of(text))


class Model:
    """Effects with parameters, axis by axis. Made by :meth:`Log.fit`, :meth:`Log.ladder` or :func:`load`."""

    def __init__(self, inner: _truerate.Model) -> None:
        self._inner = inner

    @property
    def effects(self) -> dict[str, dict[str, dict[str, float]]]:
        """Axis → effect → parameter → value, in SI units."""
        axes: dict[str, dict[str, dict[str, float]]] = {}
        for axis, effect, name, value, _ in self._inner.terms():
            axes.setdefault(axis, {}).setdefault(effect, {})[name] = value
        return axes

    def save(self, path: _PathLike) -> None:
        """Writes the model file (TOML)."""
        self._inner.save(Path(path))

    def export(
        self,
        format: str,
        *,
        rate: float | None = None,
        topic: str = "/imu/data",
        sensor: int = 1,
        chip: str | None = None,
        name: str = "model",
    ) -> str:
        """The model for another program: ``"c"``, ``"c-float"``, ``"kalibr"``, ``"ros"``, ``"ardupilot"``, ``"px4"``, ``"autoware"``,
        ``"openvins"``, ``"inav"``, ``"registers"`` (with ``chip``: ``"mpu6050"``, ``"mpu9250"``, ``"icm426xx"``, ``"bmi160"``, ``"bmi270"``) or
        ``"json"``.

        What the target cannot hold is a comment in the text.
        """
        return self._inner.export(format, name, rate, topic, sensor, chip)[0]

    def apply(
        self,
        source: Any,
        *,
        map: Mapping[str, str] | Iterable[str] | None = None,  # the flag's name
        columns: _PathLike | None = None,
        dbc: _PathLike | None = None,
    ) -> Any:
        """Compensates a log, by the very filter that runs live. No reference is needed.

        Returns a table of the kind that came in: a pandas, polars or pyarrow table for such a table, else a dict of arrays. Its columns
        are of shape (rows,): ``t``, when the row's rates are valid, s; ``rate_x``, compensated, rad/s, and NaN where the row has no
        reading of the gyro; ``rate_filtered_x`` and its standard deviation ``rate_std_x``, rad/s; ``angle_x``, the integral of the
        compensated rate, rad; ``angle_fused_x``, with the reference where there is one, rad. A pandas table keeps its index where every
        row of it is there.

        Rows that were left out (a time that repeats or goes back), and rows without a reading, are counted and located in a
        ``RuntimeWarning`` each.
        """
        reading = {
            "map": _maps(map),
            "columns": None if columns is None else Path(columns),
            "reference": None,
            "dbc": None if dbc is None else Path(dbc),
        }
        with _Source(source, reading["map"]) as file:
            try:
                names, values, says = self._inner.apply(file.path, reading)
            except Error as error:
                raise _said(error, file) from None
        table = np.frombuffer(values, "<f8").reshape(-1, len(names))
        for one in says:
            warnings.warn(f"{file.name}: {one}", RuntimeWarning, stacklevel=2)
        return _of_kind(source, {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)})

    def __reduce__(self) -> Any:
        return _model, (str(self),)

    def __str__(self) -> str:
        return self._inner.text()

    def __repr__(self) -> str:
        axes = "; ".join(f"{axis}: {', '.join(effects)}" for axis, effects in self.effects.items())
        return f"<truerate.Model {axes}>"


def _of_kind(source: Any, columns: dict[str, np.ndarray]) -> Any:
    """A table of the kind of another one: pandas, polars or pyarrow; else as it is."""
    of = type(source).__module__.split(".")[0]
    if of == "pandas":
        import pandas

        rows = len(columns["t"])
        return pandas.DataFrame(columns, index=source.index if len(source) == rows else None)
    if of == "polars":
        import polars

        return polars.DataFrame(columns)
    if of == "pyarrow":
        import pyarrow

        return pyarrow.table(columns)
    return columns


def load(path: _PathLike) -> Model:
    """Reads a model file."""
    return Model(_truerate.load(Path(path)))


def simulate(
    *,
    hide: str | Iterable[str] = (),
    motion: str = "multisine",
    seconds: float = 120.0,
    rate: float = 100.0,
    seed: int = 1,
    axis: str = "x",
) -> tuple[Log, Model]:
    """A log whose truth is known, and the true model.

    ``hide`` names effects or random causes, at their typical sizes or with values: ``"delay:d=0.012"``.

    >>> import truerate
    >>> log, truth = truerate.simulate(hide="delay:d=0.012", seconds=60)
    >>> found = log.diagnose()
    >>> found.verdict, found.suspects[0].effect
    ('missing-effect', 'delay')
    """
    hidden = [hide] if isinstance(hide, str) else list(hide)
    if not 0 <= seed < 2**64:
        raise Error(f"seed {seed}: expected a whole number from 0 on")
    with tempfile.TemporaryDirectory(prefix="truerate-") as folder:
        path = Path(folder, "simulated.csv.gz")
        truth = _truerate.simulate(path, hidden, motion, float(seconds), float(rate), seed, axis)
        reading = {"map": [], "columns": None, "reference": None, "dbc": None}
        return Log(_truerate.Log(path, "simulated", reading)), Model(truth)


def effects() -> dict[str, SimpleNamespace]:
    """The catalogue: id → ``equation`` and ``parameters`` (name → unit)."""
    return {
        id: SimpleNamespace(equation=equation, parameters=dict(parameters))
        for id, equation, parameters in _truerate.catalogue()
    }
