"""The package beside the program: the same numbers, the habits of numpy and pandas, errors that say what to do."""

import gzip
import io
import json
import os
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path
from types import SimpleNamespace

import duckdb
import numpy as np
import pandas
import polars
import pyarrow
import pytest

import truerate

PROGRAM = os.environ.get("TRUERATE")


@pytest.fixture(scope="session")
def late(tmp_path_factory):
    """A log whose gyro is 12 ms late, as a table: t in s, rates in rad/s, the reference's angle in rad."""
    rng = np.random.default_rng(7)
    t = np.arange(0, 90, 0.01)
    tones = [(0.31, 0.9), (0.83, 0.6), (1.9, 0.35), (3.7, 0.12)]
    angle = sum(a * np.sin(2 * np.pi * f * t + f) for f, a in tones)
    at = t - 0.012
    rate = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * at + f) for f, a in tones)
    step = 2 * np.pi / 65536
    table = {
        "t": t,
        "gyro_z": 1.01 * rate + 0.004 + 2e-3 * rng.standard_normal(t.size),
        "ref_angle_z": np.round(angle / step) * step,
    }
    path = tmp_path_factory.mktemp("late") / "late.csv"
    pandas.DataFrame(table).to_csv(path, index=False)
    return table, path


@pytest.fixture(scope="session")
def found(late):
    return truerate.read(late[1]).diagnose()


def test_the_hidden_effect_is_named(found):
    assert found.verdict == "missing-effect"
    assert found.suspects[0].effect == "delay"
    delay = next(p for p in found.suspects[0].parameters if p.name == "d")
    assert abs(delay.value - 0.012) < 5 * delay.std_error < 1e-3
    assert found.finding.kind == "missing"
    assert found.axes["z"].headline == found.headline
    assert "delay" in found.summary() or "late" in found.summary()


def test_a_parquet_is_the_log_that_its_table_is(late, found, tmp_path):
    table, _ = late
    path = tmp_path / "late.parquet"
    pandas.DataFrame(table).to_parquet(path, index=False)
    again = truerate.read(path).diagnose()
    assert again.headline == found.headline
    assert truerate.read(path.read_bytes()).diagnose().headline == found.headline


def test_a_ladder_makes_a_model_that_is_saved_and_applied(late, tmp_path):
    done = truerate.read(late[1]).ladder()
    assert done.verdict == "adequate"
    assert set(done.model.effects["z"]) >= {"scale-factor", "bias", "delay"}
    done.model.save(tmp_path / "model.toml")
    again = truerate.load(tmp_path / "model.toml")
    assert again.effects == done.model.effects
    assert "delay" in again.export("c")
    applied = again.apply(late[1])
    assert set(applied) == {"t", "rate_z", "rate_filtered_z", "rate_std_z", "angle_z", "angle_fused_z"}
    assert applied["rate_z"].shape == late[0]["t"].shape
    raw = late[0]["gyro_z"] - np.interp(late[0]["t"], late[0]["t"], np.gradient(late[0]["ref_angle_z"], 0.01))
    true = np.gradient(late[0]["ref_angle_z"], 0.01)
    better = applied["rate_z"] - np.interp(applied["t"], late[0]["t"], true)
    assert np.nanstd(better[500:-500]) < 0.5 * np.std(raw[500:-500])


@pytest.mark.parametrize("kind", ["dict", "pandas", "polars", "pyarrow", "duckdb", "bytes"])
def test_every_kind_of_table_gives_the_numbers_of_the_file(late, kind):
    table, path = late
    source = {
        "dict": lambda: table,
        "pandas": lambda: pandas.DataFrame(table),
        "polars": lambda: polars.DataFrame(table),
        "pyarrow": lambda: pyarrow.table(table),
        "duckdb": lambda: duckdb.sql(f"select * from read_csv('{path}')"),
        "bytes": path.read_bytes,
    }[kind]()
    here, there = (truerate.read(s).fit().to_pandas() for s in (source, path))
    assert here["value"].tolist() == there["value"].tolist()
    assert here["std_error"].tolist() == there["std_error"].tolist()


def numbers(value):
    if isinstance(value, dict):
        return {k: numbers(v) for k, v in value.items() if isinstance(v, (dict, list, float, int)) or k == "verdict"}
    if isinstance(value, list):
        return [numbers(v) for v in value]
    return value


def same(log, what, *flags, model=None):
    done = subprocess.run(
        [PROGRAM, what, str(log), *flags, "--format", "json"], capture_output=True, text=True, check=True
    )
    call = getattr(truerate.read(log), what)
    return numbers(call(model).to_dict()) == numbers(json.loads(done.stdout))


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
@pytest.mark.parametrize("what", ["fit", "diagnose", "compare", "ladder"])
def test_the_numbers_are_the_programs(late, tmp_path, what):
    assert same(late[1], what)
    file = tmp_path / "model.toml"
    truerate.read(late[1]).ladder().model.save(file)
    file.write_text(file.read_text().replace("delay.d = 0.01", "delay.d = 0.02"))
    assert same(late[1], what, "--model", str(file), model=truerate.load(file))


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
def test_the_rates_are_the_programs(late, tmp_path):
    model, out = tmp_path / "model.toml", tmp_path / "out.csv"
    truerate.read(late[1]).ladder().model.save(model)
    subprocess.run([PROGRAM, "apply", str(late[1]), "--model", str(model), "-o", str(out)], check=True)
    program, package = pandas.read_csv(out), pandas.DataFrame(truerate.load(model).apply(late[1]))
    assert list(program) == list(package)
    for name in program:
        np.testing.assert_allclose(package[name], program[name], rtol=1e-12, atol=1e-9, equal_nan=True)


def test_the_program_comes_with_the_package():
    own = Path(sys.executable).with_name("truerate")
    said = subprocess.run([own, "--version"], capture_output=True, text=True, check=True).stdout
    assert said.split() == ["truerate", truerate.__version__]


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
def test_a_simulated_log_is_the_programs(tmp_path):
    out = tmp_path / "log.csv"
    hide = ["delay:d=0.012", "reversal-steps"]
    words = [word for text in hide for word in ("--hide", text)]
    subprocess.run([PROGRAM, "simulate", *words, "--seconds", "20", "--seed", "4", "-o", str(out)], check=True)
    package, program = truerate.simulate(hide=hide, seconds=20, seed=4)[0].to_numpy(), truerate.read(out).to_numpy()
    assert all(np.array_equal(package[name], program[name], equal_nan=True) for name in program)


def test_no_sentence_names_a_command_of_the_shell(late, found):
    for result in (found, truerate.read(late[1]).fit(), truerate.read(late[1]).ladder()):
        for text in (result.summary(), json.dumps(result.to_dict())):
            assert not re.search(r"`?truerate (add|ladder|diagnose|fit|compare|apply|run|channels|effects)\b", text), text


def test_a_result_is_shown_in_a_notebook_without_reach_outside(found):
    page = found._repr_html_()
    assert page.startswith("<iframe sandbox=") and "allow-same-origin" not in page


def test_tables_come_out(found, late):
    frame = found.to_pandas()
    assert list(frame["axis"].unique()) == ["z"] and {"effect", "name", "value", "std_error", "unit"} <= set(frame)
    assert found.to_polars().height == len(frame)
    columns = truerate.read(late[1]).to_numpy()
    assert np.array_equal(columns["gyro_z"], late[0]["gyro_z"])


def test_what_cannot_be_used_is_refused_with_a_remedy(late, tmp_path):
    with pytest.raises(truerate.Error, match="no_such_file"):
        truerate.read(tmp_path / "no_such_file.csv")
    nowhen = pandas.DataFrame({"t_ns": pandas.to_datetime(["2026-01-01", None]), "gyro_z": [0.0, 0.0]})
    with pytest.raises(truerate.Error, match="row 1 has no time"):
        truerate.read(nowhen)
    with pytest.raises(truerate.Error, match="lengths"):
        truerate.read({"t": [0, 1], "gyro_z": [1.0]})
    with pytest.raises(truerate.Error, match="expected 'x'"):
        truerate.read(late[1], axis="w")
    with pytest.raises(TypeError, match="path, bytes"):
        truerate.read(3.0)
    with pytest.raises(truerate.Error, match="expected c, c-float, kalibr"):
        truerate.read(late[1]).fit().model.export("cobol")
    with pytest.raises(truerate.Error) as refused:
        truerate.read({"t": np.arange(200.0), "speed": np.ones(200)})
    assert "/tmp" not in str(refused.value) and "--map" not in str(refused.value)
    table = late[0]
    with pytest.raises(truerate.Error, match=r'truerate.read\(source, map={"ref_angle_z": "wheel"}\)'):
        truerate.read({"t": table["t"], "gyro_z": table["gyro_z"], "wheel": table["ref_angle_z"]})


def test_progress_is_told_here_and_its_exception_ends_the_search(late):
    said, threads = [], set()

    def tell(what):
        said.append(what)
        threads.add(threading.get_ident())

    truerate.read(late[1]).diagnose(progress=tell)
    assert said and threads == {threading.get_ident()}

    def ends(_):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        truerate.read(late[1]).diagnose(progress=ends)


def test_other_threads_run_while_it_works(late):
    log, ticks, done = truerate.read(late[1]), [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    log.diagnose()
    done.set()
    thread.join()
    assert len(ticks) > 3


def test_ctrl_c_ends_a_search(late):
    log, whole, begun, sent = truerate.read(late[1]), [], threading.Event(), threading.Event()
    log.ladder(progress=whole.append)
    said = []

    def tell(what):
        said.append(what)
        begun.set()
        # On a busy machine the whole search is over before another thread gets its turn.
        sent.wait(60)

    def interrupts():
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        sent.set()

    # What a shell starts in the background ignores the signal.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        thread = threading.Thread(target=interrupts)
        thread.start()
        with pytest.raises(KeyboardInterrupt):
            log.ladder(progress=tell)
        thread.join()
    finally:
        signal.signal(signal.SIGINT, before)
    assert 0 < len(said) < len(whole)


@pytest.mark.parametrize("work", ["fit", "compare", "simulate"])
def test_ctrl_c_ends_a_call_that_looks_for_nothing(work):
    n = 200_000
    t = np.arange(n) * 1e-3
    noise = 1e-3 * np.random.default_rng(1).standard_normal(n)
    log = truerate.read({"t": t, "gyro_z": np.cos(t) + noise, "ref_angle_z": np.sin(t)})
    calls = {"fit": log.fit, "compare": log.compare, "simulate": lambda: truerate.simulate(seconds=50_000)}
    timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        timer.start()
        start = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            calls[work]()
        # It is asked for ten times a second.
        assert time.monotonic() - start < 2
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


def test_an_error_goes_to_another_process():
    error = pickle.loads(pickle.dumps(truerate.Error("line 3")))
    assert isinstance(error, truerate.Error) and str(error) == "line 3" and truerate.Error.__module__ == "truerate"


def test_the_index_of_a_frame_is_its_time(late):
    table = pandas.DataFrame(late[0])
    whole = truerate.read(table).to_numpy()["t"]
    dates = pandas.to_datetime((table.t * 1e9).round().astype("int64") + 1_780_000_000_000_000_000)
    bare = table.drop(columns="t")
    for index in (
        pandas.Index(table.t),
        pandas.Index(table.t, name="time"),
        pandas.DatetimeIndex(dates),
        pandas.DatetimeIndex(dates, tz="Europe/Berlin"),
        pandas.to_timedelta(table.t, unit="s"),
    ):
        own = truerate.read(bare.set_index(index)).to_numpy()["t"]
        np.testing.assert_allclose(own - own[0], whole, atol=2e-6)
    # What the caller says goes before the index.
    said = truerate.read(bare.set_index(pandas.DatetimeIndex(dates)), map={"t": "0.01*row"}).to_numpy()["t"]
    np.testing.assert_allclose(said - said[0], whole, atol=1e-9)
    # A date has its unit, whatever the name says.
    own = truerate.read({"t_us": dates.to_numpy(), **{name: late[0][name] for name in ("gyro_z", "ref_angle_z")}})
    np.testing.assert_allclose(np.ptp(own.to_numpy()["t"]), np.ptp(whole), atol=1e-6)


def test_what_is_no_table_is_refused_in_words(late):
    table = pandas.DataFrame(late[0])
    with pytest.raises(truerate.Error, match="numbers for names .0, 1, 2."):
        truerate.read(pandas.DataFrame(table.to_numpy()))
    with pytest.raises(truerate.Error, match="two columns are named 'gyro_z'"):
        truerate.read(pandas.concat([table, table[["gyro_z"]]], axis=1))
    with pytest.raises(TypeError, match="LazyFrame has not been computed"):
        truerate.read(polars.DataFrame(late[0]).lazy())
    with pytest.raises(TypeError, match="this is one column"):
        truerate.read(table.gyro_z)
    with pytest.raises(truerate.Error, match="'temp' is one value"):
        truerate.read({**late[0], "temp": 20.0})
    with pytest.raises(TypeError, match="map: expected a dict"):
        truerate.read(table, map=5)
    with pytest.raises(truerate.Error, match="seed -1"):
        truerate.simulate(seed=-1)
    with pytest.raises(TypeError, match=r"fit\(\) got an unexpected keyword argument 'prior'"):
        truerate.fit([table, table], prior="type.toml")
    for wrong in (3, None):
        with pytest.raises(TypeError, match="not (int|NoneType)"):
            truerate.Fleet(wrong)
        with pytest.raises(TypeError, match="not (int|NoneType)"):
            truerate.merge([wrong])


def test_a_table_has_no_name_of_its_own(late):
    table = late[0]
    with pytest.raises(truerate.Error, match="which part is it"):
        truerate.evidence(table, type="S")
    own = truerate.evidence(table, type=3, name="board 7")
    assert (own.logs[0].part, own.logs[0].type, own.logs[0].log) == ("board 7", "3", "board 7")
    half, rest = ({name: values[own] for name, values in table.items()} for own in (slice(4500), slice(4500, None)))
    assert truerate.fit([table, half, truerate.read(rest, name="third")]).logs == ["table 1", "table 2", "third"]


@pytest.mark.parametrize("kind", ["binary", "text", "bytes io", "string io", "gzip", "path"])
def test_a_file_that_is_open_is_the_log(late, tmp_path, kind):
    text = late[1].read_bytes()
    if kind == "path":
        log = truerate.read(Path(late[1]))
        assert log.name == str(late[1])
    elif kind in ("binary", "text"):
        with late[1].open("rb" if kind == "binary" else "r") as file:
            log = truerate.read(file)
        assert log.name == str(late[1])
    elif kind == "gzip":
        packed = tmp_path / "late.csv.gz"
        packed.write_bytes(gzip.compress(text))
        with packed.open("rb") as file:
            log = truerate.read(file)
    else:
        log = truerate.read(io.BytesIO(text) if kind == "bytes io" else io.StringIO(text.decode()), name="mine")
        assert log.name == "mine"
    assert np.array_equal(log.to_numpy()["gyro_z"], late[0]["gyro_z"])
    # The reference may come so, too.
    alone = {name: late[0][name] for name in ("t", "gyro_z")}
    second = "t,ref_angle_z\n" + "".join(f"{t},{a}\n" for t, a in zip(late[0]["t"], late[0]["ref_angle_z"], strict=True))
    assert truerate.read(alone, reference=io.StringIO(second)).axes == ["z"]
    with pytest.raises(TypeError, match="gives bytes or text; this one gave list"):
        truerate.read(SimpleNamespace(read=list))


def test_the_table_that_comes_out_is_of_the_kind_that_came_in(late):
    model = truerate.read(late[1]).fit().model
    rates = model.apply(late[0])
    assert isinstance(rates, dict) and isinstance(model.apply(late[1]), dict)
    frame = pandas.DataFrame(late[0]).set_index(np.arange(len(late[0]["t"])) + 7)
    out = model.apply(frame)
    assert isinstance(out, pandas.DataFrame) and out.index.equals(frame.index)
    assert frame.join(out.drop(columns="t"))["rate_z"].notna().all()
    shown = {"polars": polars.DataFrame, "pyarrow": pyarrow.Table}
    tables = {"polars": model.apply(polars.DataFrame(late[0])), "pyarrow": model.apply(pyarrow.table(late[0]))}
    for kind, own in tables.items():
        assert isinstance(own, shown[kind]), kind
        assert np.array_equal(own["rate_z"].to_numpy(), rates["rate_z"], equal_nan=True), kind


def test_what_is_left_out_of_the_rates_is_counted_and_located(late):
    model = truerate.read(late[1]).fit().model
    frame = pandas.DataFrame(late[0])
    frame.loc[200:229, "gyro_z"] = np.nan
    frame = pandas.concat([frame[:401], frame[400:]], ignore_index=True)
    with pytest.warns(RuntimeWarning) as told:
        rates = model.apply(frame)
    assert np.flatnonzero(np.isnan(rates["rate_z"])).tolist() == list(range(200, 230))
    assert rates["rate_filtered_z"].notna().all() and len(rates) == len(frame) - 1
    said = [str(own.message) for own in told]
    assert any("30 rows have no reading of gyro_z (first at 2.00 s)" in one for one in said), said
    assert any("the time repeats or goes back in 1 row: left out" in one for one in said), said
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.apply(late[0])


def test_two_sensors_stand_beside_each_other_as_in_the_program(late, tmp_path):
    other, _ = truerate.simulate(seconds=60, axis="z", seed=5)
    both = truerate.side_by_side(late[1], other)
    assert both.logs == [str(late[1]), "simulated"] and set(both.axes) == {"z"}
    own = both.axes["z"]
    assert own.better == "second" and {error.tau_s for error in own.errors} >= {0.1, 1.0}
    assert [axes["z"].effects for axes in both.each] == [["scale-factor", "bias"]] * 2
    frame = both.to_pandas()
    assert list(frame["tau_s"]) == [error.tau_s for error in own.errors] and both.to_polars().height == len(frame)
    assert own.says in re.sub(r"\s+", " ", both.summary()) and not re.search(r"truerate \w+ ", both.summary())
    assert both._repr_html_().startswith("<iframe sandbox=") and pickle.loads(pickle.dumps(both)).to_dict() == both.to_dict()
    with pytest.raises(truerate.Error, match="are the same log"):
        truerate.side_by_side(late[1], late[1])
    if PROGRAM:
        copy = tmp_path / "other.csv"
        pandas.DataFrame(late[0]).assign(gyro_z=late[0]["gyro_z"] * 1.01).to_csv(copy, index=False)
        words = [PROGRAM, "compare", str(late[1]), str(copy), "--side-by-side", "--format", "json"]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        here = truerate.side_by_side(late[1], copy).to_dict()
        assert numbers(here["axes"]) == numbers(json.loads(done.stdout)["axes"])


def test_a_result_tells_its_attributes_and_why(late, found):
    names = dir(found)
    assert {"verdict", "headline", "suspects", "budget", "error_curve", "model", "summary", "explain"} <= set(names)
    assert all(hasattr(found, name) for name in names)
    assert isinstance(found.budget[0], truerate.Budget) and found.budget[0].tau_s > 0
    assert isinstance(found.parameters[0], truerate.Parameter) and isinstance(found.suspects[0], truerate.Suspect)
    with pytest.raises(truerate.Error, match="explain=True"):
        found.explain()
    told = truerate.read(late[1]).diagnose(explain=True)
    assert "delay" in told.explain() and "pass" in told.explain(full=True)
    assert pickle.loads(pickle.dumps(told)).explain(full=True) == told.explain(full=True)
    together = truerate.diagnose([late[1]])
    assert {"logs", "each", "repeats"} <= set(dir(together))


def test_one_log_does_not_tell_what_repeats(late):
    found = truerate.diagnose([late[1]])
    assert {own.of for own in found.repeats} == {"unknown"}
    assert "all one logs" not in found.summary() and "not known" in found.repeats[0].says


def test_attributes_that_are_said_are_there(found):
    assert found.random == [] or found.random[0].kind
    assert all(hasattr(own, "from_") for own in found.fails_where)


def test_the_catalogue_and_the_simulator():
    assert truerate.effects()["delay"].parameters == {"d": "s"}
    log, truth = truerate.simulate(hide=["quadratic-nonlinearity"], seconds=30, seed=3, axis="y")
    assert log.name == "simulated" and log.axes == ["y"] and "quadratic-nonlinearity" in truth.effects["y"]
    with pytest.raises(truerate.Error, match="no-such"):
        truerate.simulate(hide="no-such")


@pytest.fixture(scope="session")
def parts(tmp_path_factory):
    """Six short logs of three parts that differ in scale: path and part."""
    folder, made = tmp_path_factory.mktemp("parts"), []
    t = np.arange(0, 30, 0.01)
    tones = [(0.31, 0.9), (0.83, 0.6), (1.9, 0.35)]
    for number in range(6):
        rng, part = np.random.default_rng(number), number // 2
        rate = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * t + f + number) for f, a in tones)
        angle = sum(a * np.sin(2 * np.pi * f * t + f + number) for f, a in tones)
        path = folder / f"part-{part}-{number % 2}.csv"
        table = {
            "t": t,
            "gyro_z": (1 + 0.004 * part) * rate + 0.01 + 2e-3 * rng.standard_normal(t.size),
            "ref_angle_z": angle + 1e-4 * rng.standard_normal(t.size),
        }
        pandas.DataFrame(table).to_csv(path, index=False)
        made.append((path, part))
    return made


@pytest.fixture(scope="session")
def evidence(parts):
    return [truerate.evidence(path, part=part, type="BMI160", meta={"mount": "left"}) for path, part in parts]


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
def test_evidence_and_its_merge_are_the_programs_bytes(parts, evidence, tmp_path):
    files = []
    for path, part in parts:
        files.append(tmp_path / f"{path.stem}.evidence")
        words = ["evidence", path, "-o", files[-1], "--part", str(part), "--type", "BMI160", "--meta", "mount=left"]
        subprocess.run([PROGRAM, *words], check=True)
    for own, file in zip(evidence, files, strict=True):
        assert bytes(own) == file.read_bytes()
    subprocess.run([PROGRAM, "merge", *reversed(files), "-o", tmp_path / "all"], check=True)
    merged = truerate.merge(evidence)
    assert bytes(merged) == (tmp_path / "all").read_bytes()
    # Files, bytes and objects, in any grouping.
    again = truerate.merge([files[5], truerate.merge(evidence[1:4]), bytes(evidence[4]), files[0], evidence[5]])
    assert again == merged and len(merged) == 6
    merged.save(tmp_path / "own")
    assert (tmp_path / "own").read_bytes() == bytes(merged)
    fleet = subprocess.run(
        [PROGRAM, "fleet", tmp_path / "all", "--format", "json", "--export", tmp_path / "type.toml"],
        capture_output=True,
        text=True,
        check=True,
    )
    own = truerate.Fleet(merged)
    assert own.to_dict() == json.loads(fleet.stdout)
    assert own.type_file() == (tmp_path / "type.toml").read_text()


def test_a_fleet_has_types_and_parts_as_attributes_and_tables(evidence, tmp_path):
    fleet = truerate.Fleet(evidence)
    assert "6 logs of 3 parts" in fleet.summary() and fleet.left_out == []
    scale = next(own for own in fleet.types if own.effect == "scale-factor")
    assert scale.type == "BMI160" and len(scale.readings) == 6 and scale.next[0] < scale.mean < scale.next[1]
    # α undoes the scale: 1, 1/1.004, 1/1.008.
    own = {part.part: part.value for part in fleet.parts if part.effect == "scale-factor"}
    assert all(abs(own[str(k)] - 1 / (1 + 0.004 * k)) < 1e-3 for k in range(3)), own
    types, parts = fleet.to_pandas(), fleet.to_pandas("parts")
    assert {"type", "effect", "mean", "spread", "next_from", "next_to"} <= set(types)
    assert set(parts["part"]) == {"0", "1", "2"} and {"value", "std_error", "outlier"} <= set(parts)
    readings = fleet.to_polars("readings")
    assert readings.height == 6 * len(types) and "log" in readings.columns
    assert list(fleet.to_pandas("changes")) == []
    with pytest.raises(ValueError, match="expected 'types'"):
        fleet.to_pandas("cars")
    page = fleet._repr_html_()
    assert page.startswith("<iframe sandbox=") and "allow-same-origin" not in page and "svg" in page
    fleet.save_types(tmp_path / "type.toml")
    assert truerate.Fleet(fleet.evidence).summary() == fleet.summary()


def test_evidence_is_read_as_a_table(evidence):
    merged = truerate.merge(evidence)
    table = merged.to_pandas()
    assert list(table["part"]) == [log.part for log in merged.logs] and len(table) == 6
    assert merged.summary().startswith("Evidence of 6 logs") and "BMI160" in merged.summary()
    assert merged._repr_html_().count("<tr>") == 7 and merged.left_out == []
    first = merged.logs[0].pieces[0]
    many = len(first.columns)
    assert len(first.score) == many and len(first.information) == many * (many + 1) // 2
    assert merged.logs[0].meta.mount == "left"


def test_what_goes_to_another_process_comes_back_the_same(evidence, found, late):
    for own in (*evidence[:2], truerate.merge(evidence)):
        assert pickle.loads(pickle.dumps(own)) == own
    again = pickle.loads(pickle.dumps(found))
    assert again.to_dict() == found.to_dict() and again.summary() == found.summary() and again.verdict == found.verdict
    assert str(again.model) == str(found.model)
    fleet = truerate.Fleet(evidence)
    assert pickle.loads(pickle.dumps(fleet)).to_dict() == fleet.to_dict()
    for function in (truerate.evidence, truerate.merge, truerate.read, truerate.fit, truerate.diagnose):
        assert pickle.loads(pickle.dumps(function)) is function
    with pytest.raises(TypeError, match="send its path"):
        pickle.dumps(truerate.read(late[1]))


def test_evidence_that_cannot_be_used_is_refused(evidence, parts, tmp_path):
    file = tmp_path / "bad.evidence"
    file.write_bytes(bytes(evidence[0])[:300])
    with pytest.raises(truerate.Error, match="bad.evidence: ends in the middle"):
        truerate.merge([evidence[0], file])
    with pytest.raises(truerate.Error, match="not an evidence file"):
        truerate.Evidence(b"t,gyro_x\n0,1\n")
    other = truerate.evidence(parts[0][0], part="another", type="BMI160", meta={"mount": "left"})
    with pytest.raises(truerate.Error, match="of the same log and differ"):
        truerate.merge([evidence[0], other])
    with pytest.raises(truerate.Error, match="in number 1 of the list and .* in number 2 of the list"):
        truerate.merge([evidence[0], other])
    with pytest.raises(truerate.Error, match="no evidence"):
        truerate.merge([])
    with pytest.raises(truerate.Error, match="2026-05-31"):
        truerate.evidence(parts[0][0], meta={"day": "yesterday"})
    with pytest.raises(TypeError, match="is a list"):
        truerate.merge(evidence[0])
    with pytest.raises(TypeError, match="read already"):
        truerate.evidence(truerate.read(parts[0][0]), axis="x")


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
def test_a_new_part_starts_from_its_type_as_in_the_program(evidence, parts, tmp_path):
    fleet, kind = truerate.Fleet(evidence), tmp_path / "type.toml"
    fleet.save_types(kind)
    path = parts[0][0]
    for what in ("fit", "diagnose", "ladder"):
        words = [PROGRAM, what, str(path), "--prior", str(kind), "--format", "json"]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        for prior in (kind, fleet):
            assert numbers(getattr(truerate.read(path), what)(prior=prior).to_dict()) == numbers(json.loads(done.stdout))
    with pytest.raises(TypeError, match="not both"):
        log = truerate.read(path)
        log.fit(log.fit().model, prior=fleet)
    with pytest.raises(truerate.Error, match="cannot be read"):
        truerate.read(path).fit(prior=tmp_path / "none.toml")


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
@pytest.mark.parametrize("what", ["fit", "diagnose", "compare", "ladder"])
def test_several_logs_give_the_programs_numbers(parts, what):
    paths = [str(path) for path, _ in parts[:2]]
    done = subprocess.run([PROGRAM, what, *paths, "--format", "json"], capture_output=True, text=True, check=True)
    together = getattr(truerate, what)(paths)
    assert numbers(together.to_dict()) == numbers(json.loads(done.stdout))
    assert len(together.each) == 2 and together.logs == paths
    with pytest.raises(truerate.Error, match="same log"):
        getattr(truerate, what)([paths[0], truerate.read(paths[0])])
    with pytest.raises(TypeError, match="are a list"):
        getattr(truerate, what)(paths[0])
