"""`doctor` in a process of its own, looking at nodes of another one."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from typing import Any

import pytest

from actors import Child, Node, QoS, Service, Topic, every, publishes
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from tests.cli.conftest import Command, SystemOf
from tests.cli.stage import ADD, Adder, Talker
from tests.cli.test_topic_verbs import until

IMAGES = Topic(String, "images", QoS(depth=60))
STATE = Service(Trigger, "get_state")


class Silent(Node):
    """Publishes a topic, and never anything on it."""

    chatter = publishes(Topic(String, "sensor/data", 10))


class Source(Node):
    """Sends at 30 Hz."""

    images = publishes(IMAGES)

    @every(hz=30)
    def send(self) -> None:
        self.images(String(data="picture"))


class Slow(Node):
    """Takes 50 ms for each message."""

    @IMAGES.on()
    async def see(self, message: String) -> None:
        await self.clock.sleep(0.05)


class Battery(Node):
    @STATE.serve()
    async def state(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True)


class Poller(Node):
    """Asks at 25 Hz."""

    @every(hz=25)
    async def poll(self) -> None:
        await self.call(STATE, Trigger.Request())


def findings(report: str) -> dict[str, list[Mapping[str, Any]]]:
    """The problems of a report in JSON, by question."""
    told = json.loads(report)
    found = {one["check"]: [each for each in one["findings"] if each["level"] == "problem"] for one in told["checks"]}
    return {check: problems for check, problems in found.items() if problems}


@pytest.mark.realtime
async def test_a_topic_that_is_sent_has_no_problem_and_its_rate_is_measured(
    system_of: SystemOf, robot: Command
) -> None:
    async with system_of(Talker):
        found = await robot("doctor", "topic", "/chatter", "std_msgs/msg/String", "--seconds", "2")
    assert (found.code, found.err) == (0, ""), found.out
    (measured,) = [line for line in found.out.splitlines() if " Hz" in line]
    assert float(measured.split(", ")[1].removesuffix(" Hz")) == pytest.approx(20.0, rel=0.2)


@pytest.mark.realtime
async def test_a_topic_that_has_a_publisher_and_no_data_is_a_problem(system_of: SystemOf, robot: Command) -> None:
    async with system_of(Silent):
        found = await robot("doctor", "topic", "sensor/data", "--json")
    assert found.code == 1
    ((finding,),) = findings(found.out).values()
    assert finding["cause"] == "nothing is sent, although /silent publishes it"
    assert finding["measured"].startswith("0 messages in 1.0 s")


@pytest.mark.realtime
async def test_what_is_slow_and_what_polls_is_found_in_the_figures_of_the_running_process(
    system_of: SystemOf, robot: Command
) -> None:
    async with system_of(Source, Slow, Battery, Poller) as system:
        (queue,) = system.graph.topics["/images"].subscriptions
        await until(lambda: queue.dropped > 0)
        everything = await robot("doctor", "--json", "--seconds", "3")
        poller = await robot("doctor", "service", "/get_state", "--report-failed")
    found = findings(everything.out)
    assert everything.code == 1
    assert found["queues"][0]["subject"] == "/images"
    assert " of 60 waiting, Slow.see takes 5" in found["queues"][0]["measured"]
    assert found["age of messages"][0]["subject"] == "/images"
    assert float(found["age of messages"][0]["measured"].split(" ")[0]) == pytest.approx(59 / 30, rel=0.2)
    polled = found["no client polls"][0]
    assert polled["cause"].startswith("/poller polls it")
    assert float(polled["measured"].split(" ")[0]) == pytest.approx(25.0, rel=0.3)
    assert (poller.code, poller.out.splitlines()[0][:45]) == (1, "problem  no client polls: /get_state: /poller")


@pytest.mark.realtime
async def test_a_node_of_another_domain_is_found_there(
    system_of: SystemOf, robot: Command, environment: dict[str, str]
) -> None:
    environment["ROS_DOMAIN_ID"] = "8"
    async with system_of(Talker):
        found = await robot("doctor", "node", "/talker", "--json")
    problems = findings(found.out)
    assert found.code == 1
    assert problems["domain"][0]["measured"] == "ROS_DOMAIN_ID=8: 0 nodes; 1 node in domain 7"
    assert problems["node"][0]["cause"] == "there is no such node; it is in domain 7"


@pytest.mark.realtime
async def test_the_whole_graph_is_told_with_its_process(system_of: SystemOf, robot: Command) -> None:
    async with system_of(Talker):
        found = await robot("wtf")
    assert found.code == 0, found.out
    (line,) = [line for line in found.out.splitlines() if line.startswith("info     processes: process ")]
    assert line.endswith(": domain 7, rmw_zenoh_cpp")


async def test_the_three_cases_of_a_service_are_told_apart(system_of: SystemOf, robot: Command) -> None:
    async with system_of(Adder):
        brief = ("--seconds", "0.1")
        right, almost, other, missing = await asyncio.gather(
            robot("doctor", "service", ADD.name, "example_interfaces/srv/AddTwoInts", *brief),
            robot("doctor", "service", "/add_to_ints", "--json", *brief),
            robot("doctor", "service", "/add_two_ints", "std_srvs/srv/Trigger", "--json", *brief),
            robot("doctor", "service", "/enable", "--json", *brief),
        )
    assert right.code == 0, right.out
    assert [each.code for each in (almost, other, missing)] == [1, 1, 1]
    causes = [next(iter(findings(each.out).values()))[0]["cause"] for each in (almost, other, missing)]
    assert causes == [
        "no node serves this name; similar services: /add_two_ints",
        "it is not of the type std_srvs/srv/Trigger",
        "its server is not running",
    ]


async def test_notes_count_as_problems_if_that_is_asked_for(system_of: SystemOf, robot: Command) -> None:
    class Ear(Node):
        @IMAGES.on()
        def see(self, message: String) -> None:
            pass

    async with system_of(Child(Ear)):
        asked = ((), ("--report-failed",), ("--include-warnings", "--report-failed"), ("-iw", "--ros2-exit-codes"))
        usual, brief, strict, ros2 = await asyncio.gather(
            *(robot("doctor", "--seconds", "0.1", *words) for words in asked)
        )
    assert (usual.code, strict.code, ros2.code) == (0, 1, 0)
    assert brief.out == "0 problems, 1 note\n", "it is counted, though not printed"
    assert strict.out.splitlines()[0] == "note     names of topics: /images: nobody publishes it"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (("topc", "/x"), "doctor examines a topic, a service or a node, not 'topc'; did you mean 'topic'?\n"),
        (("topic",), "which topic? robactor topic list prints them\n"),
        (("node", "/a//b"), "'/a//b' is not a valid"),
    ],
)
async def test_words_that_doctor_does_not_understand_are_one_line(
    words: tuple[str, ...], error: str, command: Command
) -> None:
    said = await command("doctor", *words)
    assert (said.code, said.out) == (1, "")
    assert error in said.err
    assert said.err.count("\n") == 1


async def test_an_unknown_rmw_implementation_is_one_clear_line(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_connextdds")
    said = await command("doctor")
    assert (said.code, said.out) == (1, "")
    assert said.err.startswith("RMW_IMPLEMENTATION is rmw_connextdds: this library speaks rmw_zenoh_cpp, the default")


@pytest.mark.realtime
async def test_nodes_that_wait_for_a_clock_that_nobody_publishes_are_a_problem(
    system_of: SystemOf, robot: Command
) -> None:
    async with system_of(Child(Battery, parameters={"use_sim_time": True})):
        found = await robot("doctor", "--json")
    assert found.code == 1
    ((finding,),) = findings(found.out).values()
    assert finding["cause"].startswith("/battery: use_sim_time is set, and nobody publishes the time")
