"""`python -m tests.figures NAME [options]`: every figure of docs/reference/figures.md, measured again on this machine."""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from collections.abc import Sequence
from datetime import date
from typing import Final

from actors.suggest import did_you_mean
from cli.command import UsageError
from tests.figures.machine import machine
from tests.figures.measurement import PROGRAM, Measurement

NAMES: Final = (
    "walk", "arm", "barn", "sensitivity", "battery", "odometry", "pose", "kidnap", "mission", "rooms", "crowd", "ramps", "slip", "rates",
    "busy", "stops", "maps",
)  # fmt: skip
"""The measurements: modules of this package, each with its `MEASUREMENT`."""


def measurement(name: str) -> Measurement:
    """The one of this name."""
    found: Measurement = importlib.import_module(f"tests.figures.{name}").MEASUREMENT
    return found


def main(argv: Sequence[str] | None = None) -> int:
    """Run one measurement and print what it gave. The exit code: 0 if every bound is kept, 1 if one is not, 2 if it cannot be run as asked, 3
    without the engine that it needs.
    """
    name, *rest = (sys.argv[1:] if argv is None else argv) or ("",)
    if name in ("", "-h", "--help"):
        print(f"usage: {PROGRAM} NAME [options]\n")
        for one in NAMES:
            print(f"  {one:<11} {measurement(one).help}")
        return 0 if name else 2
    if name not in NAMES:
        hint = did_you_mean(name, NAMES, quoted=False) or f"; there are: {', '.join(NAMES)}"
        print(f"figures: no measurement is called {name!r}{hint}", file=sys.stderr)
        return 2
    # One thread for BLAS: small matrices gain nothing from more, and trials in several processes would fight for the cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from robot.sim.physics import BackendMissing  # not before: it imports numpy

    try:
        return _run(measurement(name), rest)
    except UsageError as error:
        print(f"figures {name}: {error}", file=sys.stderr)
        return 2
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        print(f"\nfigures {name}: interrupted", file=sys.stderr)
        return 130


def _run(chosen: Measurement, words: Sequence[str]) -> int:
    asked = chosen.parser().parse_args(words)
    began = time.monotonic()
    result = chosen.take(asked)
    values = {
        **result.values, "date": date.today().isoformat(), "machine": machine(), "wall_seconds": round(time.monotonic() - began, 1)
    }  # fmt: skip
    print(json.dumps(values, indent=2) if asked.json else result.show(values))
    return 0 if result.good else 1


if __name__ == "__main__":
    raise SystemExit(main())
