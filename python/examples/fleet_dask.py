"""The evidence of many logs, made on a Dask cluster and merged.

    python fleet_dask.py SCHEDULER logs.csv -o fleet.evidence

SCHEDULER is the address of a running scheduler (tcp://host:8786). logs.csv has a row for each log: log, type, part, and whatever else is
known of it (day, driver, mount); `truerate simulate --fleet` writes such a list. The workers read the logs by their paths, and need the
package truerate. A log that cannot be used is named at the end, and the others are merged; the exit code is then 1.
"""

import argparse
import csv
import sys
from pathlib import Path

from dask.distributed import Client, as_completed

import truerate


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scheduler")
    parser.add_argument("logs", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()

    with args.logs.open(newline="") as file:
        rows = list(csv.DictReader(file))
    parts, refused = [], []
    with Client(args.scheduler) as client:
        names = {}
        work = as_completed()
        for row in rows:
            log = row["log"]
            future = client.submit(
                truerate.evidence,
                str(args.logs.parent.resolve() / log),
                part=row["part"],
                type=row["type"],
                meta={name: value for name, value in row.items() if name not in ("log", "part", "type") and value},
                pure=False,
            )
            names[future.key] = log
            work.add(future)
        del future
        for done in work:
            if done.status == "finished":
                parts.append(done.result())
            else:
                refused.append(f"{names[done.key]}: {done.exception()}")
            # What has been collected need not be made again where a worker dies.
            done.release()
            print(f"{len(parts) + len(refused)} of {len(rows)}", flush=True)
    if parts:
        fleet = truerate.merge(parts)
        fleet.save(args.output)
        print(truerate.Fleet(fleet).summary())
    if refused or not parts:
        sys.exit("\n".join([f"{len(refused)} of {len(rows)} logs cannot be used:", *refused]))


if __name__ == "__main__":
    main()
