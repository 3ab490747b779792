"""Looking at a system: snapshots, their drawings and differences, and the passive checker."""

from __future__ import annotations

import json

from actors import Child, Node, Service, Supervisor, Topic, every, open_node, publishes, qos
from actors.check.checker import check_node, check_tree
from actors.interfaces.std_msgs.msg import Float32, String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.testing import Rig

SCAN = Topic(String, "scan", qos.SENSOR_DATA)
RESET = Service(Trigger, "reset")


class Lidar(Node):
    """Publishes scan; serves reset."""

    out = publishes(SCAN)

    @every(hz=10)
    def turn(self) -> None:
        self.out(String(data="."))

    @RESET.serve()
    async def reset(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True)


class Mapper(Node):
    """Takes scan."""

    @SCAN.on()
    def scan(self, message: String) -> None: ...


class Strict(Node):
    """Takes scan, and insists on every message."""

    @SCAN.on(qos=qos.COMMANDS)
    def scan(self, message: String) -> None: ...


TREE = Supervisor("robot", children=[Child(Lidar), Child(Mapper)])


async def test_a_snapshot_names_who_says_what_to_whom(rig: Rig) -> None:
    system = await rig.start(TREE)
    await rig.advance(10.0)
    await rig.call(RESET, Trigger.Request())
    view = system.snapshot()
    (topic,) = [topic for topic in view.topics if topic.name == "/scan"]
    assert [edge.node for edge in topic.publishers] == ["/lidar"]
    assert [edge.node for edge in topic.subscriptions] == ["/mapper"]
    assert (topic.types, topic.messages, topic.rate) == (("std_msgs/msg/String",), 100, 10.0)
    (service,) = view.services
    assert (service.name, service.type, service.server, service.clients, service.calls) == (
        "/reset", "std_srvs/srv/Trigger", "/lidar", ("/rig",), 1,
    )  # fmt: skip
    assert json.loads(view.to_json())["nodes"][0]["name"] == "/lidar"
    assert '"topic /scan" -> "node /mapper"' in view.to_dot()
    drawing = view.to_mermaid()
    assert '["/lidar"]' in drawing
    assert '("/scan")' in drawing


async def test_a_snapshot_does_not_change_with_the_system(rig: Rig) -> None:
    system = await rig.start(TREE)
    before = system.snapshot()
    await rig.advance(1.0)
    assert before.topics[0].messages == 0


async def test_the_difference_between_two_snapshots_is_what_happened_in_between(rig: Rig) -> None:
    system = await rig.start(TREE)
    before = system.snapshot()
    async with open_node("visitor") as node:
        stream = node.subscribe(SCAN)
        rig.crash(Lidar)
        await rig.settled()
        changes = before.diff(system.snapshot())
        stream.close()
    assert "+ node /visitor" in changes
    assert "+ /visitor subscribes /scan" in changes
    assert "~ node /lidar: running, incarnation 1 -> running, incarnation 2" in changes
    assert before.diff(before) == ()


def test_a_good_tree_has_no_findings() -> None:
    assert check_tree(TREE) == ()


def test_a_subscription_that_nobody_feeds_is_found_unless_it_is_external() -> None:
    lonely = Supervisor("robot", children=[Child(Mapper)])
    (finding,) = check_tree(lonely)
    assert "takes /scan, which nobody publishes" in finding.what
    assert check_tree(lonely, external=["/scan"]) == ()


def test_profiles_that_do_not_match_and_types_that_clash_are_errors() -> None:
    (finding,) = check_tree(Supervisor("robot", children=[Child(Lidar), Child(Strict)]))
    assert finding.level == "error"
    assert "reliability" in finding.what

    class Other(Node):
        """Publishes scan as a number."""

        out = publishes(Topic(Float32, "scan", qos.SENSOR_DATA))

    found = check_tree(Supervisor("robot", children=[Child(Other), Child(Mapper)]))
    assert ["std_msgs/msg/Float32" in one.what for one in found] == [True]


def test_second_servers_second_names_and_unknown_parameters_are_found() -> None:
    tree = Supervisor(
        "robot",
        children=[
            Child(Lidar),
            Child(Lidar, name="rear", parameters={"sped": 1}),
            Supervisor("inner", children=[Child(Lidar)]),
        ],
    )
    found = [str(finding) for finding in check_tree(tree)]
    assert any("second server of /reset" in one for one in found)
    assert any("second node named /lidar" in one for one in found)
    assert any("'sped' that Lidar does not declare" in one for one in found)


def test_names_against_the_style_and_loops_in_one_node_are_found() -> None:
    shouting = Topic(String, "CameraRGB")

    class Parrot(Node):
        out = publishes(shouting)

        @shouting.on()
        def hear(self, message: String) -> None: ...

    found = [str(finding) for finding in check_node(Parrot)]
    assert any("CameraRGB" in one and "rename" in one for one in found)
    assert any("no docstring" in one for one in found)
    assert any("publishes itself" in one for one in found)
