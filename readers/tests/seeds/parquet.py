"""Writes small.parquet, as pandas and pyarrow write what a user has: nested, with nulls, in two groups, packed with zstd.

    pip install pyarrow numpy && python3 parquet.py
"""
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

ROWS = 200
rate = np.sin(np.float32(0.05) * np.arange(ROWS, dtype=np.float32)).astype(np.float32)
table = pa.table({
    "stamp": pa.array(1_700_000_000_000_000 + 10_000 * np.arange(ROWS), pa.timestamp("us", tz="UTC")),
    "imu": pa.array([{"gz": float(w)} for w in rate], pa.struct([("gz", pa.float32())])),
    "accel": pa.array([[0, 0, 9.8125]] * ROWS, pa.list_(pa.float32())),
    # A reference that comes with every second row.
    "encoder_z_deg": pa.array([None if k % 2 else 0.1 * k for k in range(ROWS)], pa.float64()),
    "temp": pa.array([f"{20 + k}.50" for k in range(ROWS)]).cast(pa.decimal128(6, 2)),
    "ticks": pa.array(np.arange(ROWS) + 65_300, pa.uint32()),
    "moving": pa.array(np.arange(ROWS) % 3 == 0),
    "label": pa.array(["a, b"] * ROWS).dictionary_encode(),
    "picture": pa.array([b"\x00\x01"] * ROWS),
})
pq.write_table(table, "small.parquet", compression="zstd", row_group_size=120)
