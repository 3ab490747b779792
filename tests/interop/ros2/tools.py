"""The command ``ros2``: it shows our graph, reads and sets our parameters, drives our lifecycle, echoes, publishes, calls and sends goals."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Iterator
from pathlib import Path

from actors import LifecycleNode, Node, Service, Topic, every, parameter, publishes
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from tests.interop.parties import until
from tests.interop.ros2.bench import Bench, Check

WORDS = Topic(String, "/ours/words")
TICKS = Topic(String, "/ours/ticks")
NEW = ("--no-daemon", "--spin-time", "3")


class Ticker(Node):
    """Speaks 10 times a second."""

    ticks = publishes(TICKS)

    @every(hz=10)
    def speak(self) -> None:
        self.ticks(String(data="tick"))


class Talker(LifecycleNode):
    """Speaks 10 times a second while it is active."""

    words = publishes(WORDS)
    speed = parameter(0.5, description="how fast it walks")
    gait = parameter("trot")
    legs = parameter([1, 2, 3, 4])

    @every(hz=10)
    def speak(self) -> None:
        self.words(String(data="here"))


def checks() -> Iterator[tuple[str, Check]]:
    yield "ros2 node list, info", nodes
    yield "ros2 topic list, info", topics
    yield "ros2 service list, info", services
    yield "ros2 action list, info", actions
    yield "ros2 param list, get, describe", read_parameters
    yield "ros2 param set, dump, and a refusal", set_parameters
    yield "ros2 lifecycle nodes, get, list", read_lifecycle
    yield "ros2 lifecycle set through all states", drive_lifecycle
    yield "their listener hears our transitions, parameter changes and log lines", events
    yield "ros2 topic echo", echo
    yield "ros2 topic hz", hz
    yield "ros2 topic pub", pub
    yield "ros2 service call", call
    yield "ros2 action send_goal --feedback", send_goal
    yield "the twenty programs of twenty_theirs.py", twenty
    yield "ros2 service call of our logger services", logger_levels


async def nodes(bench: Bench) -> None:
    await bench.shows("node", "list", *NEW, parts=("/ours/robot", "/ours/counter", "/ours/talker"))
    parts = ("/ours/words: std_msgs/msg/String", "/ours/talker/get_parameters", "/ours/talker/change_state", "/rosout")
    await bench.shows("node", "info", *NEW, "/ours/talker", parts=parts)


async def topics(bench: Bench) -> None:
    parts = ("/ours/words [std_msgs/msg/String]", "/parameter_events", "/rosout", "/ours/talker/transition_event")
    await bench.shows("topic", "list", "-t", *NEW, parts=parts)
    parts = ("Publisher count: 1", "Reliability: RELIABLE", "RIHS01_df668c")
    if bench.ros.middleware != "fastrtps":  # that of Kilted tells no node of an endpoint of another middleware
        parts += ("Node name: talker", "Node namespace: /ours")
    await bench.shows("topic", "info", "-v", *NEW, "/ours/words", parts=parts)


async def services(bench: Bench) -> None:
    parts = ("/ours/talker/list_parameters [rcl_interfaces/srv/ListParameters]", "/ours/talker/get_state")
    await bench.shows("service", "list", "-t", *NEW, parts=parts)
    parts = ("Type: lifecycle_msgs/srv/GetState", "Services count: 1")
    await bench.shows("service", "info", *NEW, "/ours/talker/get_state", parts=parts)


async def actions(bench: Bench) -> None:
    await bench.with_daemon("action", "list", "-t", parts=("/ours/fibonacci [example_interfaces/action/Fibonacci]",))
    await bench.with_daemon("action", "info", "/ours/fibonacci", parts=("Action servers: 1", "/ours/counter"))


async def read_parameters(bench: Bench) -> None:
    await bench.shows("param", "list", *NEW, "/ours/talker", parts=("speed", "gait", "legs", "use_sim_time"))
    await bench.shows("param", "get", *NEW, "/ours/talker", "speed", parts=("Double value is: 0.5",))
    await bench.shows("param", "get", *NEW, "/ours/talker", "legs", parts=("[1, 2, 3, 4]",))
    await bench.shows("param", "describe", *NEW, "/ours/talker", "speed", parts=("Type: double", "how fast it walks"))


async def set_parameters(bench: Bench) -> None:
    await bench.shows("param", "set", *NEW, "/ours/talker", "speed", "0.75", parts=("Set parameter successful",))
    assert bench.ours.system.node(Talker).speed == 0.75
    await bench.shows("param", "dump", *NEW, "/ours/talker", parts=("speed: 0.75", "gait: trot"))
    text = await bench.run("param", "set", *NEW, "/ours/talker", "speed", "fast")
    assert "failed" in text.lower()
    assert bench.ours.system.node(Talker).speed == 0.75


async def read_lifecycle(bench: Bench) -> None:
    await bench.shows("lifecycle", "nodes", *NEW, parts=("/ours/talker",))
    await bench.shows("lifecycle", "get", *NEW, "/ours/talker", parts=("unconfigured [1]",))
    await bench.shows("lifecycle", "list", *NEW, "/ours/talker", parts=("configure [1]", "shutdown"))


async def drive_lifecycle(bench: Bench) -> None:
    for transition, state in (
        ("configure", "inactive"), ("activate", "active"), ("deactivate", "inactive"), ("cleanup", "unconfigured"),
        ("configure", "inactive"), ("activate", "active"),
    ):  # fmt: skip
        await bench.shows("lifecycle", "set", *NEW, "/ours/talker", transition, parts=("Transitioning successful",))
        assert bench.ours.system.node(Talker).state.name.lower() == state


async def events(bench: Bench) -> None:
    there = await bench.peer("events")
    talker = bench.ours.system.node(Talker)
    topic = "/ours/talker/transition_event"
    await there.do("subscription", topic=topic, type="lifecycle_msgs/msg/TransitionEvent", qos={})
    await there.do("subscription", topic="/parameter_events", type="rcl_interfaces/msg/ParameterEvent", qos={})
    await there.do(
        "subscription", topic="/rosout", type="rcl_interfaces/msg/Log", qos={"durability": "TRANSIENT_LOCAL"}
    )
    for each in (topic, "/parameter_events", "/rosout"):
        await until(lambda each=each: "/ros/events" in bench.ours.subscriptions(each), "its listener is known")  # type: ignore[misc]
    talker.set_parameter("gait", "walk")
    talker.log.warning("a line for everybody")
    await talker.change_state("shutdown")

    def changes() -> bool:
        changed = [
            one["changed_parameters"] for one in there.heard("/parameter_events") if one["node"] == "/ours/talker"
        ]
        return any(value["name"] == "gait" and value["value"]["string_value"] == "walk" for (value, *_) in changed)

    await until(changes, "the change of the parameter has come")
    await until(
        lambda: any("a line for everybody" in one["msg"] for one in there.heard("/rosout")), "the line has come"
    )
    await until(
        lambda: any(one["transition"]["label"] == "shutdown" for one in there.heard(topic)), "the event has come"
    )


async def echo(bench: Bench) -> None:
    assert "data: tick" in await bench.run("topic", "echo", *NEW, "--once", "/ours/ticks")


async def hz(bench: Bench) -> None:
    text = await bench.run("topic", "hz", "--spin-time", "3", "/ours/ticks", enough="average rate")
    rate = float(text.split("average rate:")[1].split()[0])
    assert 5.0 < rate < 15.0, text


async def pub(bench: Bench) -> None:
    got = bench.ours.listen(Topic(String, "/ours/ears"))
    await bench.run(
        "topic", "pub", "--times", "20", "-w", "1", "-r", "10", "/ours/ears", "std_msgs/msg/String", "{data: 'zwölf'}"
    )
    await until(lambda: len(got) >= 3, "some have come")  # Fast DDS may begin before this side has found it
    assert got[:3] == 3 * [{"data": "zwölf"}]


async def call(bench: Bench) -> None:
    async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    bench.ours.node.serve(Service(AddTwoInts, "/ours/sum"), add)
    kind = AddTwoInts.__ros_type__
    await bench.shows("service", "call", "/ours/sum", kind, "{a: 2, b: 40}", parts=("sum=42",))


async def send_goal(bench: Bench) -> None:
    kind = "example_interfaces/action/Fibonacci"
    parts = ("Goal accepted", "Feedback:", "SUCCEEDED")
    await bench.shows("action", "send_goal", "--feedback", "/ours/fibonacci", kind, "{order: 5}", parts=parts)


async def twenty(bench: Bench) -> None:
    root = Path(__file__).parents[3]
    folder = root / "tests/interop/programs"
    program, page = folder / "twenty_with_rclpy.py", folder / "twenty_theirs.py"
    environment = {**os.environ, **bench.environment}
    process = await asyncio.create_subprocess_exec(
        bench.ros.python,
        program,
        page,
        env=environment,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    try:
        async with asyncio.timeout(100):
            told, _ = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    lines = told.decode().splitlines()
    assert (process.returncode, lines[-1:]) == (0, ["all of them"]), "\n".join(lines[-20:])


async def logger_levels(bench: Bench) -> None:
    log = bench.ours.system.node(Ticker).log
    before, kind = log.level, "rcl_interfaces/srv/SetLoggerLevels"
    wanted = "{levels: [{name: ours.ticker, level: 40}]}"
    await bench.shows("service", "call", "/ours/ticker/set_logger_levels", kind, wanted, parts=("successful=True",))
    assert (before, log.level) == (20, 40)
    kind = "rcl_interfaces/srv/GetLoggerLevels"
    parts = ("name='ours.ticker', level=40",)
    await bench.shows("service", "call", "/ours/ticker/get_logger_levels", kind, "{names: [ours.ticker]}", parts=parts)
