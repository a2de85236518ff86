"""The evidence of many logs, made on a Dask cluster and merged.

    python fleet_dask.py SCHEDULER logs.csv -o fleet.evidence

SCHEDULER is the address of a running scheduler (tcp://host:8786). logs.csv has a row for each log: log, type, part, day;
`truerate simulate --fleet` writes such a list. The workers read the logs by their paths, and need the package truerate.
"""

import argparse
import csv
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
    with Client(args.scheduler) as client:
        work = [
            client.submit(
                truerate.evidence,
                str(args.logs.parent.resolve() / row["log"]),
                part=row["part"],
                type=row["type"],
                meta={"day": row["day"]},
            )
            for row in rows
        ]
        parts = []
        for done in as_completed(work):
            parts.append(done.result())
            print(f"{len(parts)} of {len(work)}", flush=True)
    fleet = truerate.merge(parts)
    fleet.save(args.output)
    print(truerate.Fleet(fleet).summary())


if __name__ == "__main__":
    main()
