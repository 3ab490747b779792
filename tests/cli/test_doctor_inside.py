"""A doctor who stays with a running system finds what `doctor` finds from outside."""

from __future__ import annotations

import os
import socket

import pytest

from actors import Backoff, Child, Node, QoS, Service, ServiceUnavailable, Topic, publishes, qos, subscribes
from actors.interfaces.geometry_msgs.msg import Twist
from actors.interfaces.rcl_interfaces.srv import GetParameters
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.testing import Rig
from actors.transport.figures import ProcessFigures
from cli.verbs.doctor import checks
from cli.verbs.doctor.inside import LOST, Inside
from cli.verbs.doctor.observation import Finding
from tests.actors.transport.hosts import Hosts
from tests.cli.doctor_stage import figures

pytestmark = pytest.mark.virtual

SPOKEN = Topic(String, "/spoken", qos.SENSOR_DATA)
HEARD = Topic(String, "/spoken", qos.DEFAULT)
PACES = Topic(String, "/paces", QoS(depth=3))
OTHER = Topic(Twist, "/paces", QoS(depth=3))
STATE = Service(Trigger, "/get_state")


class Speaker(Node):
    """Offers best effort."""

    spoken = publishes(SPOKEN)


class Hearer(Node):
    """Asks for more than is offered."""

    heard = subscribes(HEARD)


class Slow(Node):
    """Handles one message a second."""

    @PACES.on()
    async def pace(self, message: String) -> None:
        await self.clock.sleep(1.0)


class Keeper(Node):
    @STATE.serve()
    async def state(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True)


def found(inside: Inside) -> dict[str, list[Finding]]:
    """What the doctor finds now, by question, without what only says how things are."""
    seen = inside.look()
    answers = {
        check.title: [one for one in check.find(seen) if one.level != "info"] for check in checks(None, inside=True)
    }
    return {title: findings for title, findings in answers.items() if findings}


async def test_a_system_that_works_has_no_finding(rig: Rig) -> None:
    await rig.start(Speaker, Keeper)
    inside = Inside(rig.system)
    await rig.call(STATE, Trigger.Request())
    rig.probe(SPOKEN)
    assert found(inside) == {}
    await rig.advance(1.0)
    assert found(inside) == {}


async def test_ends_that_do_not_match_and_types_that_differ_are_problems(rig: Rig) -> None:
    await rig.start(Speaker, Hearer, Slow)
    rig.me.publisher(OTHER)
    problems = found(Inside(rig.system))
    (quality,) = problems["quality of service"]
    assert (quality.subject, quality.level) == ("/spoken", "problem")
    assert "nothing reaches /hearer from /speaker" in quality.cause
    (types,) = problems["types of topics"]
    assert (types.subject, types.level) == ("/paces", "problem")
    assert types.measured == "geometry_msgs/msg/Twist: /rig; std_msgs/msg/String: /slow"


async def test_messages_are_lost_while_they_are_and_were_lost_afterwards(rig: Rig) -> None:
    await rig.start(Slow)
    inside = Inside(rig.system)
    assert "queues" not in found(inside)
    for number in range(20):
        rig.publish(PACES, String(data=str(number)))
    await rig.advance(2.0)
    (now,) = found(inside)["queues"]
    await rig.advance(30.0)
    (later,) = found(inside)["queues"]
    assert (now.subject, now.level) == ("/paces", "problem")
    assert now.measured.startswith("17 dropped in 2.0 s, 17 so far")
    assert later.level == "note" and later.measured.startswith("0 dropped in 30.0 s, 17 so far")


async def test_a_node_that_has_begun_its_next_life_is_told_of(rig: Rig) -> None:
    await rig.start(Keeper)
    inside = Inside(rig.system)
    assert found(inside) == {}
    rig.crash(Keeper, RuntimeError("ordered"))
    await rig.advance(1.0)
    (now,) = found(inside)["nodes run"]
    await rig.advance(1.0)
    (later,) = found(inside)["nodes run"]
    assert (now.subject, now.level) == ("/keeper", "problem")
    assert "1 restart in 1.0 s" in now.measured
    assert (later.level, later.measured) == ("note", "1 restart so far")


async def test_a_service_that_nobody_serves_is_noted_and_those_that_every_node_has_are_served(rig: Rig) -> None:
    await rig.start(Keeper)
    with pytest.raises(ServiceUnavailable):
        await rig.call(Service(Trigger, "/get_stat"), Trigger.Request(), timeout=0.1)
    await rig.call(Service(GetParameters, "/keeper/get_parameters"), GetParameters.Request())
    rig.crash(Keeper, RuntimeError("ordered"))  # its next life opens the services of parameters when they are asked for
    await rig.advance(1.0)
    assert rig.system.graph.services["/keeper/get_parameters"].server is None
    (missing,) = found(Inside(rig.system))["servers are running"]
    assert (missing.subject, missing.level) == ("/get_stat", "problem")
    assert "/get_state" in missing.cause


async def test_a_service_whose_node_is_being_restarted_is_served(rig: Rig) -> None:
    await rig.start(Child(Keeper, backoff=Backoff(5.0, 5.0)))
    await rig.call(STATE, Trigger.Request())
    rig.crash(Keeper, RuntimeError("ordered"))
    await rig.advance(1.0)
    assert rig.system.graph.services["/get_state"].restarting is not None
    assert "servers are running" not in found(Inside(rig.system))


async def test_what_tools_listen_to_needs_no_publisher(rig: Rig) -> None:
    await rig.start(Child(Slow, name="_tool"))
    assert "names of topics" not in found(Inside(rig.system))


async def test_the_nodes_of_other_processes_are_examined_by_what_those_tell(hosts: Hosts) -> None:
    rig, _ = await hosts.start(Speaker), await hosts.start(Hearer)
    inside = Inside(rig.system)
    (quality,) = found(inside)["quality of service"]
    assert "nothing reaches /hearer from /speaker" in quality.cause

    def told(at: float, restarts: int) -> ProcessFigures:
        nodes = (figures("/hearer", restarts=restarts),)
        return ProcessFigures(
            host="other",
            process=7,
            session="b" * 32,
            program="robot",
            at=at,
            cpu=0.0,
            memory=0,
            unreadable=0,
            nodes=nodes,
        )

    inside.take(told(1.0, 0), 0.5)
    inside.take(told(2.0, 1), 0.4)
    seen = found(inside)
    assert [one.subject for one in seen["nodes run"]] == ["/hearer"]
    (lag,) = seen["clocks of machines"]
    assert (lag.subject, lag.level) == ("process 7 of other", "note")
    assert lag.measured.startswith("at least 0.400 s")
    await rig.advance(LOST + 0.1)
    assert "nodes run" not in found(inside), "it has told nothing for long: it has ended"


async def test_the_process_that_looks_is_one_of_those_that_are_seen(rig: Rig) -> None:
    await rig.start(Keeper)
    (here,) = Inside(rig.system).look().processes
    assert (here.host, here.process, here.session) == (socket.gethostname(), os.getpid(), "")
    assert "/keeper" in [node.name for node in here.nodes]
