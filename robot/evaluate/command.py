"""`python -m robot evaluate WHAT`: finds the measurement and hands it the rest of the line."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from typing import Final

from actors.suggest import did_you_mean
from cli.command import UsageError

MEASUREMENTS: Final = {
    "walk": "speed, pushes, endurance, top speed, energy and odometry of the gait, in physics",
    "arm": "the arm's kinematics and limits, how it stops, walking with it, and cups fetched and carried",
    "barn": "BARN worlds: through narrow fields never seen before, without a map and without the true pose",
    "sensitivity": "what each number of navigation decides: every one 20 % down and up, on worlds that none was chosen on",
    "battery": "the gauge's formula, the run time estimate, charging and levels, against the simulated pack",
    "odometry": "odometry without a map, pose with one, and the gyro's calibration, in physics",
    "pose": "how far the pose on the map is from the truth, on a patrol in physics",
    "kidnap": "a robot that is carried elsewhere: how soon it knows where it is, or says that places are alike",
    "mission": "two hours of patrol with docking and charging: goals, falls, and the energy of each leg",
    "rooms": "rooms with things of 5 cm to 2 m, holes and steps down that no map shows, in physics",
    "crowd": "goals among ten people who walk about, in physics: whom the robot touches",
    "ramps": "over ramps of 20 degrees, friction 0.6, to goals on them and behind them and back, in physics",
    "slip": "friction of 0.2, and ice that begins under a walking robot: falls, and who sits down, in physics",
    "rates": "the whole robot on the real clock: the rate of every stream, the control loop's punctuality, and its share of a core",
    "busy": "walking while endless loops share the only processor, without real-time scheduling: falls, in virtual time",
    "stops": "what stops a walk, at every phase and speed, and sensors that fail: falls, and how soon each is known",
    "maps": "MovingAI benchmark maps: exact path lengths and search speed",
}


def main(argv: Sequence[str]) -> int:
    """Run one measurement; 2 when there is none of that name, or it cannot be run as asked, 3 without the engine that it needs."""
    if not argv or argv[0] in ("-h", "--help"):
        print("usage: robactor evaluate WHAT [options]\n")
        for name, text in MEASUREMENTS.items():
            print(f"  {name:<11} {text}")
        return 0 if argv else 2
    name, rest = argv[0], list(argv[1:])
    if name not in MEASUREMENTS:
        hint = did_you_mean(name, MEASUREMENTS, quoted=False) or f"; there are: {', '.join(MEASUREMENTS)}"
        print(f"robot evaluate: nothing is called {name!r}{hint}", file=sys.stderr)
        return 2
    # One thread for BLAS: small matrices gain nothing from more, and trials in several processes would fight for the cores.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from robot.sim.physics import BackendMissing  # not before: it imports numpy

    try:
        code: int = importlib.import_module(f"robot.evaluate.{name}").main(rest)
    except UsageError as error:
        print(f"robot evaluate {name}: {error}", file=sys.stderr)
        return 2
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        print(f"\nrobot evaluate {name}: interrupted", file=sys.stderr)
        return 130
    return code
