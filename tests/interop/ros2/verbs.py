"""Our commands beside those of ``ros2``, on one graph with nodes of both sides: what they print is the same, word for word.

What differs from run to run (ids of goals and endpoints, measured times) is masked. Lists are compared without regard to their order.
"""

from __future__ import annotations

import asyncio
import difflib
import os
import re
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Final

from tests.interop.ros2.bench import Bench, Check

ROOT: Final = Path(__file__).parents[3]
NEW: Final = ("--no-daemon", "--spin-time", "5")
SUM = "example_interfaces/srv/AddTwoInts"
FIBONACCI = "example_interfaces/action/Fibonacci"

LISTS: Final[Mapping[str, str]] = {
    "node list": "node list",
    "node info": "node info /ros/verbs",
    "node info, hidden": "node info /ros/verbs --include-hidden",
    "node info, of ours": "node info /ours/ticker",
    "topic list": "topic list",
    "topic list -t": "topic list -t",
    "topic list -c": "topic list -c",
    "topic find": "topic find std_msgs/msg/String",
    "service list -t": "service list -t",
    "lifecycle nodes": "lifecycle nodes",
    "lifecycle list": "lifecycle list /ros/managed",
    "param list": "param list /ros/verbs",
    "param list, of ours": "param list /ours/ticker",
    "interface list": "interface package std_srvs",
}
"""Commands whose lines may come in any order."""

TEXTS: Final[Mapping[str, str]] = {
    "topic info": "topic info /ours/ticks",
    "topic info -v, of theirs": "topic info -v /ros/state",
    "topic type": "topic type /ours/ticks",
    "topic echo --once": "topic echo --once /ours/ticks",
    "topic echo, kept": "topic echo --once --qos-durability transient_local --qos-reliability reliable /ros/state",
    "topic echo, a field": "topic echo --once --qos-durability transient_local --qos-reliability reliable --field name /ros/state",
    "topic echo --csv": "topic echo --once --qos-durability transient_local --qos-reliability reliable --csv /ros/state",
    "service info": "service info /ros/sum",
    "lifecycle get": "lifecycle get /ros/managed",
    "param get": "param get /ros/verbs speed",
    "param get, a list": "param get /ros/verbs legs",
    "param describe": "param describe /ros/verbs speed",
    "param dump": "param dump /ros/verbs",
    "param get, what is not there": "param get /ros/verbs spee",
    "interface show": "interface show --no-comments std_msgs/msg/Header",
    "interface show, of an action": f"interface show --no-comments {FIBONACCI}",
    "interface proto": "interface proto geometry_msgs/msg/Twist",
}

WITHOUT: Final = ("interface", "topic echo")
"""Commands of ``ros2`` that take no `NEW`, or should not wait."""


def checks() -> Iterator[tuple[str, Check]]:
    for name, line in LISTS.items():
        yield f"robactor and ros2: {name}", partial(same, line=line, ordered=False)
    for name, line in TEXTS.items():
        yield f"robactor and ros2: {name}", partial(same, line=line, ordered=True)
    yield "robactor and ros2: service call", partial(call, values="{a: 2, b: 40}")
    yield "robactor and ros2: service type, find; action list, info, type, find", with_daemon
    yield "robactor and ros2: action send_goal -f", send_goal
    yield "robactor and ros2: param set", set_parameter
    yield "robactor and ros2: lifecycle set", change_state
    yield "robactor and ros2: topic pub --once", publish
    yield "robactor and ros2: topic hz", rate


_NOISE: Final = (
    "Waiting for an action server", "Waiting for at least", "Ignoring unexpected goal response", "TYPELOOKUP_SERVICE",
)  # fmt: skip
"""Lines that only ``ros2`` writes, or whoever has to wait; the last when Fast DDS of Kilted meets itself."""


def masked(text: str) -> str:
    """The text without what differs from run to run, and without the nearest names, which only ours tells."""
    text = re.sub(r"\b[0-9a-f]{32}\b", "ID", text)
    text = re.sub(r"GID: [0-9a-f.]+", "GID: ...", text)
    text = re.sub(r"; did you mean .*", "", text)
    text = re.sub(
        r"KEEP_LAST \(1\)", "UNKNOWN", text
    )  # which of them ros2 says of a history that Fast DDS has not told
    lines = [line.rstrip() for line in text.strip().splitlines() if not any(part in line for part in _NOISE)]
    return "\n".join(lines).strip()


async def peers(bench: Bench) -> None:
    """The nodes of ROS 2 that are looked at: ``/ros/verbs`` and ``/ros/managed``, made once."""
    there = await bench.peer("verbs")
    await bench.peer("managed", "lifecycle")
    if there.said("done"):
        return
    await there.do("declare", parameters={"speed": 0.5, "gait": "trot", "legs": [1, 2, 3, 4]})
    await there.do("server", service="/ros/sum", type=SUM, answers={})
    await there.do("action_server", action="/ros/fibonacci")
    await there.do(
        "publisher", topic="/ros/state", type="sensor_msgs/msg/JointState", qos={"durability": "TRANSIENT_LOCAL"}
    )
    state = {"name": ["hip", "knee"], "position": [0.5, -1.25e-7], "velocity": [1.0, 2.0]}
    await there.do("publish", topic="/ros/state", message={"header": {"frame_id": "base: ünïcode"}, **state})
    await there.do("subscription", topic="/ros/ears", type="std_msgs/msg/String", qos={})


async def ours(bench: Bench, *words: str, enough: str = "") -> str:
    """What our command writes."""
    kept = {name: value for name, value in os.environ.items() if name != "AMENT_PREFIX_PATH"}
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "robot", *words, "--ros2-exit-codes",
        stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT, env={**kept, **bench.own, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert process.stdout is not None
    text = ""
    try:
        async with asyncio.timeout(60):
            async for line in process.stdout:
                text += line.decode()
                if enough and enough in text:
                    break
    finally:
        if process.returncode is None and enough:
            process.kill()
        await process.wait()
    return text


async def theirs(bench: Bench, *words: str, enough: str = "") -> str:
    """What ``ros2`` writes, also if it fails."""
    try:
        return await bench.run(*words, enough=enough)
    except AssertionError as error:
        head, _, text = str(error).partition("\n")
        if "exit code" not in head:
            raise
        return text


def equal(found: str, expected: str, *, ordered: bool = True, without: str = "") -> None:
    """Raises AssertionError with the differences; if there is a `without`, but for lines that have it, and empty ones."""
    one, other = (
        [line for line in masked(text).splitlines() if not without or (line and without not in line)]
        for text in (found, expected)
    )
    if not ordered:
        one, other = sorted(one), sorted(other)
    differ = list(difflib.unified_diff(other, one, "ros2", "robactor", lineterm="", n=0))
    assert not differ, " | ".join(differ[2:14])


def lost(bench: Bench) -> str:
    """What is in lines that cannot be compared: Fast DDS of Kilted loses some ends of its own actions beside any Cyclone DDS that has an action."""
    return "/ros/fibonacci" if bench.ros.middleware == "fastrtps" else ""


async def same(bench: Bench, line: str, ordered: bool) -> None:
    await peers(bench)
    words = line.split()
    more = () if line.startswith(WITHOUT) else NEW
    for attempt in range(3):  # ros2 may look before it has found all
        try:
            found, expected = await ours(bench, *words), await theirs(bench, *words, *more)
            return equal(found, expected, ordered=ordered, without=lost(bench))
        except AssertionError:
            if attempt == 2:
                raise


async def call(bench: Bench, values: str) -> None:
    await peers(bench)
    words = ("service", "call", "/ros/sum", SUM, values)
    equal(await ours(bench, *words), await theirs(bench, *words))


async def with_daemon(bench: Bench) -> None:
    """Commands that ask the daemon of ``ros2``, which is given time to find all."""
    await peers(bench)
    await bench.run("daemon", "stop")
    await bench.run("daemon", "start")
    try:
        for line, part in (
            ("service type /ros/sum", "AddTwoInts"),
            (f"service find {SUM}", "/ros/sum"),
            ("action list -t", "Fibonacci"),
            ("action info -t /ros/fibonacci", "Fibonacci"),
            ("action type /ros/fibonacci", "Fibonacci"),
            (f"action find {FIBONACCI}", "/ros/fibonacci"),
        ):
            if bench.ros.middleware == "fastrtps" and line.startswith("action") and "list" not in line:
                continue  # see `lost`
            expected = await bench.shows(*line.split(), parts=(part,))
            equal(await ours(bench, *line.split()), expected, ordered=False, without=lost(bench))
    finally:
        await bench.run("daemon", "stop")


async def send_goal(bench: Bench) -> None:
    await peers(bench)
    for order in (4, 41):
        words = ("action", "send_goal", "-f", "/ros/fibonacci", FIBONACCI, f"{{order: {order}}}")
        for attempt in range(3):  # by DDS, feedback may be faster than the answer to the goal
            try:
                equal(await ours(bench, *words), await theirs(bench, *words))
                break
            except AssertionError:
                if attempt == 2:
                    raise


async def set_parameter(bench: Bench) -> None:
    await peers(bench)
    for name, value in (("speed", "0.75"), ("speed", "fast"), ("legs", "[4, 3]"), ("gait", "walk")):
        words = ("param", "set", "/ros/verbs", name, value)
        equal(await ours(bench, *words), await theirs(bench, *words, *NEW))


async def change_state(bench: Bench) -> None:
    """The commands take turns, so that both drive the node through its states."""
    await peers(bench)
    for transition in ("configure", "activate", "deactivate", "cleanup"):
        words = ("lifecycle", "set", "/ros/managed", transition)
        mine = await ours(bench, *words)
        for back in {"configure": ("cleanup",), "activate": ("deactivate",), "deactivate": ("activate",)}.get(
            transition, ("configure",)
        ):
            await ours(bench, "lifecycle", "set", "/ros/managed", back)
        equal(mine, await theirs(bench, *words, *NEW))
    words = ("lifecycle", "set", "/ros/managed", "activate")
    equal(await ours(bench, *words), await theirs(bench, *words, *NEW))


async def publish(bench: Bench) -> None:
    await peers(bench)
    words = ("topic", "pub", "--once", "/ros/ears", "std_msgs/msg/String", "{data: 'zwölf'}")
    equal(await ours(bench, *words), await theirs(bench, *words))


async def rate(bench: Bench) -> None:
    """The same form; the measured numbers agree within a tenth."""
    await peers(bench)
    found = [
        await each(bench, "topic", "hz", "-w", "20", "/ours/ticks", *more, enough="window: 20")
        for each, more in ((ours, ()), (theirs, ("--spin-time", "3")))
    ]
    # The first messages may come at once: Fast DDS finds a writer later than that finds it, and is then sent what it has missed.
    last = [masked(text).split("average rate:")[-1] for text in found]
    shapes = [re.sub(r"\d+(\.\d+)?", "N", text) for text in last]
    equal(shapes[0], shapes[1])
    rates = [float(text.split()[0]) for text in last]
    assert abs(rates[0] - rates[1]) < 0.1 * rates[1], rates
