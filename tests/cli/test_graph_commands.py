"""`node list`, `topic list` and `topic echo` from another process, on the graph of this one."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator

import pytest
import pytest_asyncio

from actors import Child, Node, System, Topic, every, publishes, qos, run, subscribes
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.std_msgs.msg import String
from actors.transport import transport_from_environment
from tests.cli.conftest import Command
from tests.wires import BOTH

CHATTER = Topic(String, "chatter", 10)
LATCHED = Topic(String, "robot/description", qos.LATCHED)
VELOCITY = Topic(Twist, "cmd_vel", 10)


class Talker(Node):
    chatter = publishes(CHATTER)
    description = publishes(LATCHED)

    async def on_start(self) -> None:
        self.description.publish(String(data="four legs"))

    @every(hz=20)
    def talk(self) -> None:
        self.chatter.publish(String(data="hello"))


class Base(Node):
    velocities = subscribes(VELOCITY)


@pytest_asyncio.fixture
async def system(environment: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> AsyncGenerator[System]:
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    transport = transport_from_environment(environment)
    tree = (Child(Talker, name="talker"), Child(Base, name="base", namespace="robot"))
    async with run(*tree, transport=transport, signals=False, sinks=()) as system:
        yield system


@BOTH
async def test_the_nodes_of_another_process_are_listed_by_their_full_names(
    system: System, environment: dict[str, str], robot: Command
) -> None:
    listed = await robot("node", "list")
    assert (listed.code, listed.out, listed.err) == (0, "/robot/base\n/talker\n", "")
    counted = await robot("node", "list", "-c")
    assert (counted.code, counted.out) == (0, "2\n")
    async with run(
        Child(Node, name="_hidden"), transport=transport_from_environment(environment), signals=False, sinks=()
    ):
        everything = await robot("node", "list", "--all")
        assert everything.out == "/_hidden\n/robot/base\n/talker\n"
        assert (await robot("node", "list")).out == "/robot/base\n/talker\n"


@BOTH
async def test_topics_are_listed_with_types_and_with_those_who_use_them(system: System, robot: Command) -> None:
    names = await robot("topic", "list")
    assert names.out == "/chatter\n/parameter_events\n/robot/cmd_vel\n/robot/description\n/rosout\n"
    typed = await robot("topic", "list", "-t")
    assert "/chatter [std_msgs/msg/String]\n" in typed.out
    assert "/robot/cmd_vel [geometry_msgs/msg/Twist]\n" in typed.out
    verbose = await robot("topic", "list", "-v")
    published, subscribed = verbose.out.split("\n\n", 1)
    assert " * /chatter [std_msgs/msg/String] 1 publisher" in published.splitlines()
    assert published.startswith("Published topics:\n")
    assert subscribed == "Subscribed topics:\n * /robot/cmd_vel [geometry_msgs/msg/Twist] 1 subscriber\n\n"


@BOTH
async def test_what_is_sent_is_printed_as_yaml(system: System, robot: Command) -> None:
    heard = await robot("topic", "echo", "/chatter", "--once")
    assert (heard.code, heard.out, heard.err) == (0, "data: hello\n---\n", "")
    assert (await robot("topic", "echo", "chatter", "--once", "--field", "data")).out == "hello\n---\n"


@BOTH
async def test_what_was_said_before_is_heard_if_the_publisher_keeps_it(system: System, robot: Command) -> None:
    assert (await robot("topic", "echo", "/robot/description", "--once")).out == "data: four legs\n---\n"


@BOTH
async def test_a_topic_that_nobody_publishes_yet_is_waited_for_when_its_type_is_known(
    system: System, robot: Command
) -> None:
    waiting = asyncio.ensure_future(robot("topic", "echo", "/robot/cmd_vel", "--once", "--field", "linear.x"))
    command = system.node(Talker).publisher(Topic(Twist, "/robot/cmd_vel", 10))
    while not waiting.done():
        command.publish(Twist(linear=Vector3(x=0.5)))
        await asyncio.sleep(0.05)
    heard = waiting.result()
    assert (heard.code, heard.out) == (0, "0.5\n---\n")


async def test_a_slip_of_the_pen_is_one_line_with_the_nearest_name(system: System, robot: Command) -> None:
    unknown = await robot("topic", "echo", "/chater")
    assert (unknown.code, unknown.out) == (1, "")
    assert unknown.err == (
        "WARNING: topic [/chater] does not appear to be published yet; did you mean '/chatter'?\n"
        "Could not determine the type for the passed topic: give it after the topic\n"
    )
    field = await robot("topic", "echo", "/chatter", "--field", "dta")
    assert (field.code, field.out) == (1, "")
    assert field.err == "Invalid field 'dta': there is no 'dta'; it has data; did you mean 'data'?\n"
    kind = await robot("topic", "echo", "/other", "std_msgs/msg/Strin")
    assert kind.code == 1
    assert kind.err.startswith("The passed message type is invalid: ")
    assert "std_msgs/msg/String" in kind.err
    assert kind.err.count("\n") == 1


async def test_an_endpoint_that_cannot_be_is_one_line(robot: Command) -> None:
    wrong = await robot("node", "list", "--connect", "tpc/10.0.0.1:7447")
    assert (wrong.code, wrong.out) == (1, "")
    assert wrong.err == "cannot connect at 'tpc/10.0.0.1:7447': 'tpc' is no protocol of Zenoh; did you mean 'tcp'?\n"


async def test_a_domain_that_is_no_number_is_one_line(environment: dict[str, str], robot: Command) -> None:
    environment["ROS_DOMAIN_ID"] = "home"
    wrong = await robot("topic", "list")
    assert (wrong.code, wrong.out) == (1, "")
    assert wrong.err == "ROS_DOMAIN_ID='home': a domain is a number from 0 to 232\n"


async def test_with_nobody_there_the_list_is_empty(robot: Command) -> None:
    assert (await robot("node", "list", "--spin-time", "0.2")).out == ""


async def test_silence_ends_with_an_error_if_a_limit_is_given(system: System, robot: Command) -> None:
    silent = await robot("topic", "echo", "/robot/cmd_vel", "--timeout", "0.3")
    assert silent.code == 1
    assert silent.err == "nobody publishes /robot/cmd_vel now; waiting\nno message on /robot/cmd_vel for 0.3 s\n"
