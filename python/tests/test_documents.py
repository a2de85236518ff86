"""The Python of docs/python.md runs, block by block, on logs of the names that it uses."""

import re
from pathlib import Path

import numpy as np
import pandas

import truerate

DOCUMENT = Path(__file__).parents[2] / "docs" / "python.md"


def drive(seed=5):
    """A gyro that is 12 ms late, and the encoder's angle."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 60, 0.01)
    tones = [(0.31, 0.9), (0.83, 0.6), (1.9, 0.35), (3.7, 0.12)]
    angle = sum(a * np.sin(2 * np.pi * f * t + f) for f, a in tones)
    rate = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * (t - 0.012) + f) for f, a in tones)
    step = 2 * np.pi / 65536
    gyro = 1.01 * rate + 0.004 + 2e-3 * rng.standard_normal(t.size)
    return pandas.DataFrame({"t": t, "gyro_z": gyro, "ref_angle_z": np.round(angle / step) * step})


def test_what_the_page_on_the_package_shows_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    table = drive()
    for seed, name in enumerate(["log.csv.gz", "drive.csv", "a.csv", "b.csv", "c.csv", "new.csv.gz", "other.csv"], 5):
        drive(seed).to_csv(name, index=False)
    table[["t", "gyro_z"]].to_csv("imu.csv", index=False)
    table[["t", "ref_angle_z"]].to_csv("vicon.csv", index=False)
    truerate.evidence("other.csv", part=3, type="BMI160").save("fleet.evidence")
    counts = table.gyro_z * 57.29577951308232 * 131
    names = {"frame": pandas.DataFrame({"t": table.t, "gz": counts, "ref_angle_z": table.ref_angle_z})}
    blocks = re.findall(r"^```python\n(.*?)^```", DOCUMENT.read_text(), re.M | re.S)
    assert len(blocks) >= 5
    for block in blocks:
        exec(compile(block, str(DOCUMENT), "exec"), names)
    assert names["late"].error_over_floor < names["late"].before[0].error_over_floor / 5
    assert abs(names["done"].model.effects["z"]["delay"]["d"] - 0.012) < 1e-3
    assert "truerate_step" in names["header"] and len(names["rates"]["rate_z"]) == len(table)
