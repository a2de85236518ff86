"""truerate: what is wrong with a low-cost gyro.

A log holds the readings of a gyro and a reference (an encoder's angle, a rate, an orientation). truerate
says how far the gyro is off, which physical effect its model is missing, and what the rate really is::

    import truerate

    log = truerate.read("log.csv.gz")
    found = log.diagnose()
    print(found.headline)
    done = log.ladder()
    done.model.save("model.toml")

Many logs of one sensor, or of many sensors, are reduced to evidence, merged, and read as a fleet::

    parts = [truerate.evidence(path, part=path.stem, type="BMI160") for path in paths]
    fleet = truerate.Fleet(truerate.merge(parts))
    print(fleet.summary())

The numbers are those of the program ``truerate``, to the last bit. All of them are in SI units: rad, rad/s, s.
"""

from ._logs import (
    Axis,
    Budget,
    DataFault,
    ErrorPoint,
    Log,
    Model,
    Parameter,
    Result,
    Suspect,
    effects,
    load,
    read,
    simulate,
)
from ._many import Evidence, Fleet, SideBySide, compare, diagnose, evidence, fit, ladder, merge, side_by_side
from ._truerate import Error, __version__

__all__ = [
    "Axis",
    "Budget",
    "DataFault",
    "Error",
    "ErrorPoint",
    "Evidence",
    "Fleet",
    "Log",
    "Model",
    "Parameter",
    "Result",
    "SideBySide",
    "Suspect",
    "__version__",
    "compare",
    "diagnose",
    "effects",
    "evidence",
    "fit",
    "ladder",
    "load",
    "merge",
    "read",
    "side_by_side",
    "simulate",
]
