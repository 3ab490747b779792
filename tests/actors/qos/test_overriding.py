"""Quality of service by parameters, where an endpoint allows it: ROS 2's `qos_overrides`."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest

from actors import (
    Child,
    Node,
    QoS,
    StartFailed,
    Supervisor,
    Topic,
    parameter,
    publishes,
    qos,
    run,
    subscribes,
    system_of,
    transient,
)
from actors.interfaces.std_msgs.msg import String
from actors.launch.children import known_parameters
from actors.parameters.client import EVENTS, ParameterClient
from actors.parameters.files import ParameterOverrides
from actors.qos import InvalidQoS, resolve_publisher, resolve_subscription
from actors.running.options import parameters_by_node
from actors.testing import Rig
from tests.facts import lacks
from tests.stage import word

SCAN = Topic(String, "scan", qos.DEFAULT.overridable())
FIXED = Topic(String, "fixed")


class Laser(Node):
    """Publishes with what it is given."""

    scan = publishes(SCAN)
    fixed = publishes(FIXED)


class Reader(Node):
    """Reads in the three ways."""

    def __init__(self) -> None:
        self.seen: list[str] = []

    stream = subscribes(SCAN)

    @SCAN.on(qos=QoS(depth=5).overridable("reliability", "durability", id="slow"))
    def read(self, message: String) -> None:
        self.seen.append(message.data)


class Both(Laser):
    """Has a parameter, too."""

    speed = parameter(1.0)


class Plain(Node):
    """Has an endpoint of a fixed profile."""

    fixed = publishes(FIXED)


def offered(rig: Rig, node: str = "laser") -> QoS:
    laser = rig.node(node)
    assert isinstance(laser, Laser)
    return laser.scan.qos


async def test_parameters_given_at_the_start_change_what_is_offered(rig: Rig) -> None:
    overrides = {"qos_overrides./scan.publisher.reliability": "best_effort", "qos_overrides./scan.publisher.depth": 3}
    await rig.start(Child(Laser, parameters=overrides), Child(Laser, name="plain"))
    assert (offered(rig).reliability, offered(rig).depth) == ("best_effort", 3)
    assert (offered(rig, "plain").reliability, offered(rig, "plain").depth) == ("reliable", 10)


async def test_the_parameters_are_declared_with_what_holds_and_cannot_be_set_later(rig: Rig) -> None:
    await rig.start(Child(Laser, parameters={"qos_overrides./scan.publisher.depth": 3}))
    client = ParameterClient(rig.me, "laser")
    names = (await client.list(["qos_overrides"])).names
    values = {name: await client.get(name) for name in names}
    assert values == {
        "qos_overrides./scan.publisher.history": "keep_last",
        "qos_overrides./scan.publisher.depth": 3,
        "qos_overrides./scan.publisher.reliability": "reliable",
    }
    described = await client.describe("qos_overrides./scan.publisher.depth")
    assert described.read_only and described.description == "depth for publisher `/scan`"
    assert not (await client.set("qos_overrides./scan.publisher.depth", 5)).successful


async def test_a_node_with_parameters_of_its_own_takes_both(rig: Rig) -> None:
    await rig.start(Child(Both, parameters={"qos_overrides./scan.publisher.depth": 3, "speed": 2.0}))
    both = rig.node(Both)
    assert (both.scan.qos.depth, both.speed) == (3, 2.0)


async def test_each_kind_of_endpoint_has_names_of_its_own(rig: Rig) -> None:
    overrides = {
        "qos_overrides./spot/scan.subscription.depth": 2,
        "qos_overrides./spot/scan.subscription_slow.reliability": "best_effort",
        "qos_overrides./spot/scan.subscription_slow.durability": "transient_local",
    }
    await rig.start(Child(Reader, namespace="/spot", parameters=overrides))
    system = system_of(rig.me)
    stream, handled = system.graph.topics["/spot/scan"].subscriptions
    assert (stream.qos.depth, stream.qos.reliability) == (2, "reliable")
    assert (handled.qos.depth, handled.qos.reliability, handled.qos.transient_local) == (5, "best_effort", True)


async def test_a_restart_reads_them_again(rig: Rig) -> None:
    overrides = {"qos_overrides./scan.subscription_slow.reliability": "best_effort"}
    await rig.start(Child(Reader, restart=transient, parameters=overrides))
    rig.crash(Reader)
    await rig.settled()
    rig.publish(SCAN, word("seen"))
    await rig.settled()
    reader = rig.node(Reader)
    assert rig.incarnation(Reader) == 2 and reader.seen == ["seen"]
    assert reader.get_parameter("qos_overrides./scan.subscription_slow.reliability").value == "best_effort"


async def test_endpoints_made_at_run_time_take_theirs_too(rig: Rig) -> None:
    class Late(Node):
        async def on_start(self) -> None:
            self.late = self.publisher(SCAN)
            self.second = self.publisher(SCAN, qos=QoS(depth=7).overridable())
            self.on(SCAN, self.read)
            self.stream = self.subscribe(SCAN)

        def read(self, message: String) -> None:
            """Take it."""

    overrides = {
        "qos_overrides./scan.publisher.depth": 4,
        "qos_overrides./scan.subscription.reliability": "best_effort",
    }
    await rig.start(Child(Late, parameters=overrides))
    late = rig.node(Late)
    assert (late.late.qos.depth, late.second.qos.depth) == (4, 4)
    assert late.subscription(SCAN).qos.reliability == "best_effort"


@pytest.mark.parametrize(
    ("policy", "value", "attribute", "held"),
    [
        ("history", "keep_all", "history", "keep_all"),
        ("durability", "transient_local", "durability", "transient_local"),
        ("liveliness", "manual_by_topic", "liveliness", "manual_by_topic"),
        ("deadline", 250_000_000, "deadline", 0.25),
        ("lifespan", 1_500_000_000, "lifespan", 1.5),
        ("liveliness_lease_duration", 2_000_000_000, "liveliness_lease", 2.0),
    ],
)
async def test_every_policy_that_is_named_can_be_overridden(
    rig: Rig, policy: str, value: Any, attribute: str, held: Any
) -> None:
    topic = Topic(String, "scan", qos.DEFAULT.overridable(policy))
    kind = type("Any", (Node,), {"scan": publishes(topic)})
    await rig.start(Child(kind, name="any", parameters={f"qos_overrides./scan.publisher.{policy}": value}))
    node: Any = rig.node("any")
    assert getattr(node.scan.qos, attribute) == held


async def test_a_subscription_has_no_lifespan(rig: Rig) -> None:
    await rig.start(Node)
    stream = rig.me.subscribe(Topic(String, "scan", qos.DEFAULT.overridable("lifespan", "depth")))
    assert rig.me.has_parameter("qos_overrides./scan.subscription.depth")
    assert not rig.me.has_parameter("qos_overrides./scan.subscription.lifespan") and stream.received == 0


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ({"qos_overrides./scan.publisher.reliability": "sure"}, "/laser: the parameters for its publisher of /scan: 'sure'"),
        ({"qos_overrides./scan.publisher.depth": -1}, "depth must be 0 or more"),
        ({"qos_overrides./scan.publisher.depth": "many"}, "depth"),
        ({"qos_overrides./scan.publisher.durability": "volatile"}, "has no parameter 'qos_overrides./scan.publisher.durability'"),
        ({"qos_overrides./fixed.publisher.depth": 1}, "has no parameter 'qos_overrides./fixed.publisher.depth'"),
    ],
)  # fmt: skip
async def test_what_cannot_be_is_refused_when_the_node_starts(rig: Rig, overrides: dict[str, Any], said: str) -> None:
    with pytest.raises(StartFailed) as failed:
        await rig.start(Child(Laser, parameters=overrides))
    assert said in str(failed.value)


async def test_the_endpoint_may_refuse_a_profile(rig: Rig) -> None:
    def not_deep(profile: QoS) -> str | None:
        return "more than 20 would be stale" if profile.depth > 20 else None

    class Careful(Node):
        scan = publishes(SCAN, qos=qos.DEFAULT.overridable(validate=not_deep))

    with pytest.raises(
        StartFailed, match=r"its publisher of /scan cannot be QoS\(keep_last 50.*: more than 20 would be stale"
    ):
        await rig.start(Child(Careful, parameters={"qos_overrides./scan.publisher.depth": 50}))


async def test_a_refusal_does_not_stand_in_the_way_of_what_is_allowed(rig: Rig) -> None:
    class Careful(Node):
        scan = publishes(SCAN, qos=qos.DEFAULT.overridable(validate=lambda profile: None))

    await rig.start(Child(Careful, parameters={"qos_overrides./scan.publisher.depth": 20}))
    assert rig.node(Careful).scan.qos.depth == 20


async def test_observers_hear_of_the_parameters_once(rig: Rig) -> None:
    await rig.start(Node)
    events = rig.probe(EVENTS)
    await rig.system.join(Child(Laser))
    told = [one.name for event in events for one in event.new_parameters]
    assert sorted(told) == sorted(set(told)) and "qos_overrides./scan.publisher.depth" in told


@pytest.mark.virtual
async def test_a_tree_is_started_with_a_parameter_file_in_ros_2_s_form() -> None:
    text = """
/laser:
  ros__parameters:
    qos_overrides:
      /scan:
        publisher:
          reliability: best_effort
          depth: 2
"""
    entries = dict(ParameterOverrides().with_text(text).entries)
    async with run(Laser, parameters=entries, sinks=()) as system:
        assert (system.node(Laser).scan.qos.reliability, system.node(Laser).scan.qos.depth) == ("best_effort", 2)


def test_it_is_an_equal_profile_that_may_be_changed() -> None:
    overridable = qos.LATCHED.overridable("depth", id="a")
    assert overridable == qos.LATCHED and hash(overridable) == hash(qos.LATCHED) and qos.LATCHED.overriding is None
    for copied in (copy.deepcopy(overridable), pickle.loads(pickle.dumps(overridable)), overridable.replace(depth=5)):
        assert (
            copied.overriding is not None and copied.overriding.policies == ("depth",) and copied.overriding.id == "a"
        )
    with pytest.raises(InvalidQoS, match="'speed' is no policy that can be overridden; there are deadline, depth, "):
        qos.DEFAULT.overridable("depth", "speed")


def test_parameters_of_a_part_of_a_tree_keep_those_for_its_endpoints() -> None:
    tree = Supervisor("robot", children=[Child(Laser), Child(Node, name="other"), Child(Plain)])
    depth = {"qos_overrides./scan.publisher.depth": 3}
    assert parameters_by_node("here", tree, {"/**": depth}) == {"/laser": depth, "/other": depth}


def test_a_launch_file_gives_them_to_the_nodes_that_have_such_endpoints() -> None:
    told: list[str] = []
    given = {"qos_overrides./scan.publisher.depth": 3, "speed": 1}
    assert known_parameters(Child(Laser), given, "/laser", told.append) == {"qos_overrides./scan.publisher.depth": 3}
    assert lacks(*told, "/laser parameter 'speed' left out") == []
    assert known_parameters(Child(Plain), given, "/plain", told.append) == {}


def test_what_may_be_overridden_of_one_profile_is_not_resolved_for_an_equal_one() -> None:
    first = QoS(depth=97).overridable("depth", validate=lambda profile: "never")
    assert resolve_publisher(first).overriding is first.overriding
    assert resolve_publisher(QoS(depth=97)).overriding is None
    assert resolve_subscription(QoS(depth=97)).overriding is None
    assert resolve_subscription(QoS(depth=97).overridable("history")).overriding is not None
