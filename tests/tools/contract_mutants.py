"""`python -m tests.tools.contract_mutants [--count N] [--seed S]`: contracts that are renamed, retyped or given another profile, which the tables must notice.

A contract is a `Topic`, `Service` or `Action` at the top of `robot/contracts.py` or of a tutorial. First come those that tests once did not notice, then
`count` that are drawn. Each is put into a copy of the project, and the tests of the tables run there. Exit code 0 if every mutant is killed.
"""

from __future__ import annotations

import argparse
import ast
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Final, NamedTuple

from tests.tools.mutants.mutate import Mutant
from tests.tools.mutants.trial import Workshop

ROOT: Final = Path(__file__).parents[2]
FILES: Final = ("robot/contracts.py", "robot/tutorials/*.py")
TABLES: Final = ("tests/robot/nodes/test_contract_tables.py",)
LIMIT: Final = 120.0
"""Seconds that the tables may take with a mutant."""
TYPES: Final = {"Topic": "Clock", "Service": "Empty", "Action": "LookupTransform"}
"""Another type for each kind of contract, which none of them has."""
IMPORTS: Final = (
    "from actors.interfaces.rosgraph_msgs.msg import Clock\nfrom actors.interfaces.std_srvs.srv import Empty\n"
    "from actors.interfaces.tf2_msgs.action import LookupTransform\nfrom actors.qos import of as _of\n"
)


class Known(NamedTuple):
    """A mutant by hand: in this file this text becomes that one."""

    path: str
    old: str
    new: str


KNOWN: Final = (
    Known("robot/tutorials/talker_listener.py", '"/chatter", 10', '"/chat", 10'),
    Known("robot/tutorials/talker_listener.py", '"/chatter", 10', '"/chatter", 11'),
    Known("robot/tutorials/sensor_data.py", '"/sensor_data"', '"/sensor_dat"'),
    Known("robot/tutorials/move_to_position.py", '"/move_to_position"', '"/move_to"'),
    Known("robot/tutorials/spot_controller.py", '"/spot/stand"', '"/spot/stand_up"'),
    Known("robot/tutorials/calibration.py", '"calibrate_sensor"', '"calibrate"'),
    Known("robot/tutorials/sensor_pair.py", '"/cmd_vel", 1', '"/cmd", 7'),
    Known("robot/tutorials/humanoid_lab.py", '"/motor/commands", 10', '"/motor/commands", 1'),
    Known("robot/tutorials/camera_topics.py", "QoS(depth=5, ", "QoS(depth=50, "),
    Known("robot/tutorials/communication_demo.py", '"temperature_alert", 10', '"temperature_warning", 3'),
    Known("robot/tutorials/imu_publisher.py", '"/imu/data"', '"/imu"'),
    Known("robot/tutorials/imu_publisher.py", "qos.SENSOR_DATA", "10"),
    Known("robot/contracts.py", '"/joint_states"', '"/joints"'),
    Known("robot/contracts.py", '"/get_battery_status"', '"/battery"'),
    Known("robot/contracts.py", '"/cmd_vel", qos.COMMANDS', '"/cmd_vel", qos.SENSOR_STREAM'),
    Known("robot/contracts.py", '"/map", qos.MAP', '"/map", qos.DEFAULT'),
    Known("robot/contracts.py", '"/lidar/scan", qos.SENSOR_DATA', '"/lidar/scan", qos.DEFAULT'),
)
"""Of these seventeen, tests that import the contracts noticed two."""


def known(root: Path) -> list[Mutant]:
    """The mutants by hand. Raises ValueError for a text that is not there exactly once."""
    found: list[Mutant] = []
    for path, old, new in KNOWN:
        source = (root / path).read_text(encoding="utf-8")
        if source.count(old) != 1:
            raise ValueError(f"{path}: {old!r} is there {source.count(old)} times")
        line = source[: source.index(old)].count("\n") + 1
        found.append(Mutant(path, line, "by hand", old, new, source.replace(old, new)))
    return found


def drawn(root: Path, count: int, seed: int) -> list[Mutant]:
    """`count` mutants of all there are, the same for the same seed and sources."""
    every = [
        mutant
        for pattern in FILES
        for path in sorted(root.glob(pattern))
        for mutant in mutants_of(path.relative_to(root).as_posix(), path.read_text(encoding="utf-8"))
    ]
    return Random(seed).sample(every, min(count, len(every)))


def mutants_of(path: str, source: str) -> Iterator[Mutant]:
    """Each contract of a file: renamed, retyped and, if it is a topic, twice with another profile."""
    for statement in ast.parse(source).body:
        match statement:
            case ast.Assign(targets=[ast.Name()], value=ast.Call(func=ast.Name(id=kind)) as call) if kind in TYPES:
                name = call.args[1]
                assert isinstance(name, ast.Constant)
                yield _changed(path, source, name, "renamed", repr(f"{name.value}_2"))
                yield _changed(path, source, call.args[0], "retyped", TYPES[kind])
                if kind == "Topic":
                    profile = ast.unparse(call.args[2]) if len(call.args) > 2 else "10"
                    yield from _re_profiled(path, source, call, profile)


def _re_profiled(path: str, source: str, call: ast.Call, profile: str) -> Iterator[Mutant]:
    was = f"_of({profile})"
    deeper = f"{was}.replace(depth={was}.depth + 1)"
    other = f"{was}.replace(reliability='best_effort' if {was}.reliable else 'reliable')"
    for kind, text in (("deeper", deeper), ("reliability", other)):
        changed = f"Topic({ast.unparse(call.args[0])}, {ast.unparse(call.args[1])}, {text})"
        yield _changed(path, source, call, f"re-profiled: {kind}", changed)


def _changed(path: str, source: str, node: ast.expr, kind: str, text: str) -> Mutant:
    """The file with another text in the place of an expression, and with the names that it may need."""
    lines = source.splitlines(keepends=True)
    begin, end = node.lineno - 1, (node.end_lineno or node.lineno) - 1
    head, tail = lines[begin].encode()[: node.col_offset].decode(), lines[end].encode()[node.end_col_offset :].decode()
    changed = "".join([*lines[:begin], f"{head}{text}{tail}", *lines[end + 1 :]])
    future = "from __future__ import annotations\n"
    return Mutant(path, node.lineno, kind, ast.unparse(node), text, changed.replace(future, f"{future}\n{IMPORTS}", 1))


def main() -> int:
    """Try the mutants, and print each with its fate."""
    parser = argparse.ArgumentParser(prog="python -m tests.tools.contract_mutants", description="Changed contracts.")
    parser.add_argument("--count", type=int, default=30, help="how many to draw (default: 30)")
    parser.add_argument("--seed", type=int, default=0, help="which ones (default: 0)")
    options = parser.parse_args()
    fates: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="contracts-") as folder:
        workshop = Workshop(ROOT, Path(folder), ("actors", "robot", "cli", "tests"))
        workshop.baseline(TABLES)
        for mutant in [*known(workshop.folder), *drawn(workshop.folder, options.count, options.seed)]:
            fate = workshop.try_out(mutant, TABLES, LIMIT)
            fates[fate] += 1
            print(f"{fate:<9}  {mutant}", flush=True)
    print(f"{fates['killed']} of {fates.total()} killed, seed {options.seed}")
    return int(fates["killed"] != fates.total())


if __name__ == "__main__":
    sys.exit(main())
