"""The words of `python -m robot run`: parsed and checked before anything starts. A mistake is one line and exit code 2."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Literal

from cli.command import UsageError
from cli.parsing import Parser
from robot.hardware.sensors import SensorKind
from robot.run.disturbances import Push, parse_ground, parse_push
from robot.run.machines import Machines, parse_machines
from robot.run.parser import declare
from robot.run.tasks import Crash, Fetch, Goal, Hang, checked, parse_fault, parse_fetch, parse_goal
from robot.sim.ground import Ground

VIRTUAL_DURATION = 120.0
"""A run on the virtual clock needs an end; this is its default, seconds."""

_OF_HARDWARE = ("interface", "domain", "enable")
_WITH_HARDWARE = frozenset(
    ("hardware", "duration", "listen", "connect", "security", "no_web", "web", "web_host", "web_origin", "bags", "log_format", "log_level",
     "motor_delay")
)  # fmt: skip
"""Words that mean something to a robot that exists."""


@dataclass(frozen=True, slots=True)
class Web:
    """Where the web server listens."""

    host: str = "127.0.0.1"
    port: int | None = None
    """None: the usual one, or the next that is free."""
    origins: tuple[str, ...] = ()
    """Pages of other places that may connect."""
    wanted: bool = False
    """Whether it was asked for, so that the run ends if it cannot be had."""
    bags: str | None = None
    """The folder in which the page records bags; None: it does not."""


@dataclass(frozen=True, slots=True)
class RealRobot:
    """A robot that exists."""

    make: str
    interface: str | None
    """The network that it is on; None: the one that the middleware chooses."""
    domain: int
    """Its DDS domain."""
    enable: bool
    """Whether its motors are commanded."""


@dataclass(frozen=True, slots=True)
class Options:
    """Everything a run can be told."""

    duration: float | None
    battery: float
    crashes: tuple[Crash, ...]
    clock: Literal["real", "virtual"]
    world: str
    backend: Literal["physics", "kinematic"]
    seed: int
    goal: Goal | None
    params: str | None
    log_format: Literal["console", "json"]
    log_level: str
    report: str | None
    motor_delay: float
    flight_record: str | None
    trace: bool
    publish_clock: float | None
    only: tuple[str, ...]
    """The nodes to run; empty: all of them."""
    arm: bool
    fetch: Fetch | None
    listen: tuple[str, ...]
    """The endpoints where other machines connect to."""
    connect: tuple[str, ...]
    """The endpoints of other machines to connect to."""
    processes: bool
    """Whether the body and each concern of the tree have a process of their own."""
    machines: Machines | None
    """Which concerns run on other machines; None: none does."""
    hangs: tuple[Hang, ...]
    security: str | None
    """A security file."""
    replay: tuple[str, ...]
    """The nodes of which journals are kept."""
    journals: str | None
    """The folder of the files of these journals; None: one that is removed at the end."""
    spans: bool
    """Whether OpenTelemetry is given spans of calls and goals."""
    ground: Ground | None
    """What the physical body stands on and carries, if it was said."""
    pushes: tuple[Push, ...]
    sight: bool
    """Whether it has depth cameras and an elevation map."""
    real_drives: bool
    """Whether the drives of the physical body are as they are; if not, with their torque limit at any speed and temperature."""
    map: str | None
    """The map file that the robot is given; None: its map is made of the world."""
    robot: str
    """Its name, or the file of its figures."""
    sensors: SensorKind
    """How wrong the body's sensors are."""
    web: Web | None
    """The web server beside the robot; None: there is none."""
    hardware: RealRobot | None
    """The robot that exists; None: it is simulated."""


def parse(argv: Sequence[str]) -> Options:
    """Raises `UsageError`; `--help` ends in argparse's own way (exit 0)."""
    given = _parser().parse_args(_with_negative_values(argv))
    hardware = _hardware(given)
    machines = parse_machines(given.host)
    _check_together(given)
    if given.publish_clock is not None:
        checked("--publish-clock", given.publish_clock, 0.1, 1000.0, "Hz")
    ground = parse_ground(given.friction, given.payload, given.slope)
    if given.backend == "kinematic" and (ground is not None or given.push):
        raise UsageError(
            "--friction, --payload, --slope, --push: the kinematic body feels no forces; leave out --backend kinematic"
        )
    if given.backend == "kinematic" and given.actuators == "real":
        raise UsageError("--actuators real: the kinematic body has no torques to limit; leave out --backend kinematic")
    real = given.backend == "physics" and given.actuators != "ideal"
    duration = given.duration
    if duration is None and given.clock == "virtual":
        duration = VIRTUAL_DURATION
    return Options(
        duration=duration,
        battery=checked("--battery", given.battery, 0.0, 100.0, "per cent"),
        crashes=tuple(Crash(*parse_fault("--crash", text, duration)) for text in given.crash),
        clock=given.clock,
        world=given.world,
        backend=given.backend,
        seed=given.seed,
        goal=parse_goal(given.goal),
        params=given.params,
        log_format=given.log_format,
        log_level=given.log_level,
        report=_writable("--report", given.report),
        motor_delay=checked("--motor-delay", given.motor_delay, 0.0, 20.0, "milliseconds") / 1e3,
        flight_record=_regular("--flight-record", _writable("--flight-record", given.flight_record)),
        trace=given.trace,
        publish_clock=given.publish_clock,
        only=_names(given.only),
        arm=given.arm or given.fetch is not None,
        fetch=parse_fetch(given.fetch, given.goal),
        listen=tuple(given.listen),
        connect=tuple(given.connect),
        processes=given.processes,
        machines=machines,
        hangs=tuple(Hang(*parse_fault("--hang", text, duration)) for text in given.hang),
        security=given.security,
        replay=_names(given.replay),
        journals=given.journals,
        spans=given.spans,
        ground=ground,
        pushes=tuple(parse_push(text, duration) for text in given.push),
        map=given.map,
        sight=given.sight,
        real_drives=real,
        robot=given.robot,
        sensors=given.sensors,
        web=_web(given),
        hardware=hardware,
    )


def _check_together(given: argparse.Namespace) -> None:
    """Refuse words that do not go together. Raises `UsageError`."""
    if given.trace and given.clock != "virtual":
        raise UsageError("--trace: two runs are equal on the virtual clock only; add --clock virtual")
    if given.clock == "virtual" and (given.listen or given.connect or given.security or given.host):
        raise UsageError(
            "--listen, --connect, --security, --host: other machines live in real time; leave out --clock virtual"
        )
    if given.host and not (given.listen or given.connect):
        raise UsageError(
            "--host: what runs there must reach this robot: add --listen tls/0.0.0.0:7448, or --connect with the endpoint of a router"
        )
    if given.host and given.processes and not given.connect:
        raise UsageError(
            "--host: with --processes what runs there must reach each of them: start `robactor router` here, and add --connect with its endpoint"
        )
    if given.processes and given.clock == "virtual":
        raise UsageError("--processes: processes live in real time; leave out --clock virtual")
    if given.processes and given.backend == "kinematic":
        raise UsageError("--processes: only the physics body has a process of its own; leave out --backend kinematic")
    if given.robot != "spot" and (given.arm or given.fetch or given.sight):
        raise UsageError("--robot: the arm and the depth cameras are those of spot; leave out --arm, --fetch, --sight")
    if given.replay and (given.processes or given.host):
        other = "--processes" if given.processes else "--host"
        raise UsageError(f"--replay: journals are kept of nodes of this process; leave out {other}")
    if given.spans and find_spec("opentelemetry") is None:
        raise UsageError('--spans: OpenTelemetry is not installed: pip install "robactor[otel]"')
    if given.spans and given.processes:
        raise UsageError("--spans: they are made of nodes of this process; leave out --processes")
    if given.journals is not None and not given.replay:
        raise UsageError("--journals: give the nodes: --replay NODE")
    if given.hang and not given.processes:
        raise UsageError("--hang: in one process everything would hang, so nothing could notice it; add --processes")
    if given.processes and given.push:
        raise UsageError("--push: a body in a process of its own cannot be pushed from here; leave out --processes")


def _hardware(given: argparse.Namespace) -> RealRobot | None:
    """The robot that exists. Raises `UsageError` for words of the simulation beside it, and for its words without it."""
    words = _OF_HARDWARE if given.hardware is None else vars(given).keys() - _WITH_HARDWARE - set(_OF_HARDWARE)
    usual = _parser().get_default
    wrong = ", ".join(f"--{word.replace('_', '-')}" for word in sorted(words) if getattr(given, word) != usual(word))
    if given.hardware is None:
        if wrong:
            raise UsageError(f"{wrong}: which robot? Add --hardware unitree")
        return None
    if wrong:
        raise UsageError(f"{wrong}: --hardware is a robot that exists, not a simulated one; leave out one of them")
    return RealRobot(given.hardware, given.interface, given.domain, given.enable)


def _with_negative_values(argv: Sequence[str]) -> list[str]:
    """The words with ``--push -30,0@10`` as one: argparse takes a word that begins with a minus for an option, unless it is a number."""
    words: list[str] = []
    for word in argv:
        if words and words[-1] == "--push" and word[:1] == "-" and word[1:2].isdigit():
            words[-1] += f"={word}"
        else:
            words.append(word)
    return words


def _web(given: argparse.Namespace) -> Web | None:
    """The settings of the web server. There is one on the real clock unless it is switched off."""
    wanted = given.web is not None or given.web_host is not None or bool(given.web_origin) or given.bags is not None
    if given.no_web and wanted:
        raise UsageError("--no-web: leave out the other options of the web server, or this one")
    if given.clock == "virtual" and wanted:
        raise UsageError("--web: browsers live in real time; leave out --clock virtual")
    if given.no_web or given.clock == "virtual":
        return None
    return Web(given.web_host or "127.0.0.1", given.web, tuple(given.web_origin), wanted, given.bags)


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="robactor run",
        description="Run the whole robot in a world: it stands up, walks its patrol, reports battery and pose, docks when low, and sits when told to stop.",
    )
    declare(parser.add_argument)
    return parser


def _names(words: Sequence[str] | None) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name for word in words or () for name in word.split(",") if name))
    if words is not None and not names:
        raise UsageError("--only: name at least one node, such as --only gait")
    return names


def _writable(option: str, path: str | None) -> str | None:
    """The path, if a file can be written there as far as can be seen without writing one. Raises `UsageError`."""
    if path is None:
        return None
    folder = os.path.dirname(os.path.abspath(path))
    if not path:
        raise UsageError(f"{option}: name a file")
    if not os.path.isdir(folder):
        raise UsageError(f"{option} {path}: there is no folder {folder} to write it in")
    if os.path.isdir(path):
        raise UsageError(f"{option} {path}: that is a folder")
    if not os.access(path if os.path.exists(path) else folder, os.W_OK):
        raise UsageError(f"{option} {path}: no permission to write it")
    return path


def _regular(option: str, path: str | None) -> str | None:
    """Refuse devices and pipes: the file is written beside its place and then put there, which would take the device away."""
    if path is not None and os.path.exists(path) and not os.path.isfile(path):
        raise UsageError(f"{option} {path}: that is no regular file")
    return path
