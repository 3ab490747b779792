"""Global parameters (P-08): set once, read from any node."""

from __future__ import annotations

from typing import Any

import pytest

from actors import Child, Node, ServiceUnavailable, SetResult, Supervisor, Topic, every, qos
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.nodes import parameter_server as module
from actors.nodes.parameter_server import ParameterServer, get_global, set_global
from actors.parameters import ParameterNotDeclared
from actors.testing import Rig

EVENTS = Topic(ParameterEvent, "/parameter_events", qos.PARAMETER_EVENTS)


class Reader(Node):
    """Reads a global parameter at every tick."""

    async def on_start(self) -> None:
        self.read: list[Any] = []

    @every(hz=1)
    async def tick(self) -> None:
        self.read.append(await get_global(self, "/global_param_name", "unset"))


class Leg(Reader):
    pass


class Arm(Reader):
    pass


def robot(**values: Any) -> Supervisor:
    return Supervisor("robot", children=[Child(ParameterServer, parameters=values), Child(Leg), Child(Arm)])


async def test_set_once_and_read_from_two_nodes(rig: Rig) -> None:
    await rig.start(robot())
    await rig.advance(1.5)
    assert await set_global(rig.me, "/global_param_name", 42) == SetResult()
    await rig.advance(1.0)
    assert rig.node(Leg).read == ["unset", 42]
    assert rig.node(Arm).read == ["unset", 42]


def test_the_documentation_says_that_ros_2_has_no_such_server() -> None:
    assert "ROS 2 has no such server" in (module.__doc__ or "")


async def test_values_of_the_tree_are_there_from_the_start(rig: Rig) -> None:
    await rig.start(robot(max_speed=1.5, names=["front", "rear"], use_sim_time=False))
    assert await get_global(rig.me, "max_speed") == 1.5
    assert await get_global(rig.me, "names") == ("front", "rear")
    assert rig.node(ParameterServer).values == {"max_speed": 1.5, "names": ("front", "rear")}


async def test_an_unset_one_is_an_error_unless_there_is_an_alternative(rig: Rig) -> None:
    await rig.start(robot())
    with pytest.raises(ParameterNotDeclared, match=r"'max_speed' at /parameter_server.*set it first"):
        await get_global(rig.me, "max_speed")
    assert await get_global(rig.me, "max_speed", 0.3) == 0.3
    assert await get_global(rig.me, "max_speed", None) is None


async def test_a_value_may_change_its_type_and_be_deleted(rig: Rig) -> None:
    await rig.start(robot(mode="walk"))
    assert (await set_global(rig.me, "mode", 3)).successful
    assert await get_global(rig.me, "mode") == 3
    assert (await set_global(rig.me, "mode", None)).successful
    assert await get_global(rig.me, "mode", "none") == "none"
    assert rig.node(ParameterServer).values == {}


async def test_what_no_parameter_can_hold_is_refused(rig: Rig) -> None:
    await rig.start(robot())
    with pytest.raises(TypeError, match="cannot hold"):
        await set_global(rig.me, "mode", {"a": 1})
    refused = await set_global(rig.me, "start_type_description_service", False)
    assert not refused.successful
    assert "read-only" in refused.reason


async def test_every_change_is_told_on_parameter_events(rig: Rig) -> None:
    await rig.start(robot())
    told = rig.probe(EVENTS)
    await set_global(rig.me, "mode", "walk")
    await set_global(rig.me, "mode", "trot")
    first, second = told.messages
    assert [one.name for one in first.new_parameters] == ["mode"]
    assert [one.value.string_value for one in second.changed_parameters] == ["trot"]
    assert first.node == second.node == "/parameter_server"


async def test_values_survive_a_crash_of_the_server_deletions_too(rig: Rig) -> None:
    await rig.start(robot(mode="walk", speed=1.0))
    await set_global(rig.me, "mode", "trot")
    await set_global(rig.me, "speed", None)
    await set_global(rig.me, "legs", 4)
    rig.crash(ParameterServer)
    await rig.settled()
    assert rig.incarnation(ParameterServer) == 2
    assert rig.node(ParameterServer).values == {"mode": "trot", "legs": 4}
    await set_global(rig.me, "legs", 6)
    rig.crash(ParameterServer)
    await rig.settled()
    assert await get_global(rig.me, "legs") == 6


async def test_without_a_server_the_error_names_what_is_missing(rig: Rig) -> None:
    rig.expect_failure(ServiceUnavailable)
    await rig.start(Leg)
    with pytest.raises(ServiceUnavailable, match="/parameter_server/get_parameters"):
        await get_global(rig.me, "mode", "walk", timeout=0.5)
    with pytest.raises(ServiceUnavailable, match="/parameter_server/set_parameters_atomically"):
        await set_global(rig.me, "mode", "walk", timeout=0.5)


async def test_a_robot_of_a_fleet_may_have_its_own(rig: Rig) -> None:
    await rig.start(Child(ParameterServer, name="globals", namespace="/spot1"))
    await set_global(rig.me, "mode", "walk", server="/spot1/globals")
    assert await get_global(rig.me, "mode", server="/spot1/globals") == "walk"
