"""A control loop on truerate's rate: holds a vehicle's z axis still, and knows what to do without a rate.

    python3 control_loop.py /dev/shm/truerate-1000-default

It writes its command, a line a row, to standard output: time, rate, command.
"""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import truerate

GAIN = 0.8  # command per rad/s
LIMIT = 1.0  # of the command
TRUSTED = 0.2  # rad/s: a larger standard deviation is not acted on
PATIENCE = 0.05  # s without a row after which the command is 0


def command(row):
    if not row.has(2) or row.rate_std[2] > TRUSTED:
        return 0.0
    return max(-LIMIT, min(LIMIT, -GAIN * row.rate[2]))


def main(path):
    while not os.path.exists(path):
        time.sleep(0.02)
    with truerate.Shared(path) as rate:
        while (row := rate.wait(PATIENCE)) is not truerate.ENDED:
            if row is None:
                print("none 0 0", flush=True)
            elif not row.flags & truerate.END:
                print("%.9f %.9g %.9g" % (row.valid_ns * 1e-9, row.rate[2], command(row)), flush=True)


if __name__ == "__main__":
    main(sys.argv[1])
