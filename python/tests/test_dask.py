"""Evidence on a Dask cluster: a scheduler and two workers, one of which is killed during the work."""

import csv
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("distributed")

PROGRAM = os.environ.get("TRUERATE")
EXAMPLE = Path(__file__).parent.parent / "examples" / "fleet_dask.py"

FLEET = """
seed = 3
seconds = 30.0
[type.BMI160]
parts = 3
logs = 2
first_day = "2026-01-05"
days = 7
scale = { mean = 1.003, parts = 0.0012 }
bias = { mean = 0.0, parts = 0.017, logs = 0.002 }
effects = []
"""


@pytest.mark.skipif(not PROGRAM, reason="TRUERATE names no program")
def test_a_worker_that_dies_changes_no_byte(tmp_path):
    (tmp_path / "fleet.toml").write_text(FLEET)
    subprocess.run([PROGRAM, "simulate", "--fleet", "fleet.toml", "-o", "logs"], cwd=tmp_path, check=True)
    address = tmp_path / "scheduler.json"
    loopback = ["--host", "127.0.0.1", "--no-dashboard"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    processes = [
        subprocess.Popen(
            [sys.executable, "-m", "distributed.cli.dask_scheduler", *loopback, "--port", "0", "--scheduler-file", address], **quiet
        )
    ]
    try:
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", *loopback, "--scheduler-file", address, "--nthreads", "1"]
        processes += [subprocess.Popen([*worker, "--no-nanny", "--name", name], **quiet) for name in ("a", "b")]
        wait_for(address.exists)
        where = json.loads(address.read_text())["address"]
        merged = tmp_path / "merged.evidence"
        # One more log, which is broken, and what else is known of the logs.
        (tmp_path / "logs" / "broken.csv").write_text("t,gyro_x\n0,not a number\n")
        listed = (tmp_path / "logs" / "logs.csv").read_text().splitlines()
        more = ["broken.csv" + "," * (listed[0].count(","))]
        rows = [listed[0] + ",driver", *(row + ",1.3" for row in listed[1:] + more)]
        (tmp_path / "logs" / "all.csv").write_text("\n".join(rows) + "\n")
        words = [sys.executable, EXAMPLE, where, tmp_path / "logs" / "all.csv", "-o", merged]
        work = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        processes.append(work)
        assert work.stdout.readline() == "1 of 7\n"
        # The second worker is in the middle of a log, or waits for one.
        processes[2].kill()
        said, refused = work.communicate(timeout=100)
        assert work.returncode == 1 and "7 of 7" in said and "6 logs of 3 parts" in said, said
        assert "1 of 7 logs cannot be used" in refused and "broken.csv" in refused and "Traceback" not in refused, refused
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert merged.read_bytes() == by_the_program(tmp_path)


def wait_for(is_there):
    end = time.monotonic() + 60
    while not is_there():
        assert time.monotonic() < end, "no scheduler came up"
        time.sleep(0.05)


def by_the_program(folder):
    """The bytes of the program's own evidence of the same logs, merged in another order."""
    files = []
    with (folder / "logs" / "logs.csv").open(newline="") as list_of_logs:
        for row in csv.DictReader(list_of_logs):
            files.append(f"{row['log']}.evidence")
            labels = ["--part", row["part"], "--type", row["type"], "--meta", f"day={row['day']}", "--meta", "driver=1.3"]
            words = [PROGRAM, "evidence", f"logs/{row['log']}", "-o", files[-1], *labels]
            subprocess.run(words, cwd=folder, check=True)
    subprocess.run([PROGRAM, "merge", *reversed(files), "-o", "all.evidence"], cwd=folder, check=True)
    return (folder / "all.evidence").read_bytes()
