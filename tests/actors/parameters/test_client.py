"""`ParameterClient`: the parameters of another node, read, set, watched, dumped and loaded."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actors import (
    Child,
    DynamicSupervisor,
    Node,
    Parameter,
    ServiceUnavailable,
    SetResult,
    StartFailed,
    parameter,
    run,
    temporary,
)
from actors.interfaces.rcl_interfaces.msg import ParameterEvent
from actors.parameters import (
    ParameterChange,
    ParameterDescriptor,
    ParameterNotDeclared,
    ParameterType,
    ParameterUninitialized,
)
from actors.parameters.client import EVENTS, ParameterClient
from actors.parameters.files import InvalidParams, ParameterOverrides
from actors.parameters.text import parameter_file
from actors.testing import Rig


class Driver(Node):
    """Has a parameter of each kind that matters here."""

    speed = parameter(0.5, unit="m/s", ge=0.0, le=2.0)
    gait = parameter("trot")
    legs = parameter(4)
    gains = parameter([1.0, 2.0])

    async def on_start(self) -> None:
        self.declare_parameter("group.name", "yes")


async def client(rig: Rig, remote: str = "/driver") -> ParameterClient:
    await rig.start(Driver)
    return ParameterClient(rig.me, remote)


async def test_it_reads_values_names_and_descriptions(rig: Rig) -> None:
    driver = await client(rig)
    assert await driver.get("speed") == 0.5
    assert [one.value for one in await driver.get_parameters(["gait", "legs"])] == ["trot", 4]
    names = await driver.list()
    assert {"speed", "gait", "legs", "gains", "group.name", "use_sim_time"} <= set(names.names)
    assert await driver.list(["group"]) == type(names)(("group.name",), ("group",))
    described = await driver.describe("speed")
    assert described.floating_point_range is not None and described.floating_point_range.to_value == 2.0
    assert repr(driver) == "ParameterClient('/driver')"


async def test_a_name_without_a_slash_is_in_the_namespace_of_the_asking_node(rig: Rig) -> None:
    class Asker(Node):
        pass

    await rig.start(Child(Driver, namespace="/spot"), Child(Asker, namespace="/spot"))
    near = ParameterClient(rig.node(Asker), "driver")
    assert near.remote == "/spot/driver" and await near.get("legs") == 4


async def test_it_sets_one_several_or_all_or_none(rig: Rig) -> None:
    driver = await client(rig)
    node = rig.node(Driver)
    assert await driver.set("speed", 1.5) == SetResult() and node.speed == 1.5
    assert (await driver.set("speed", 9.0)).successful is False and node.speed == 1.5
    results = await driver.set_parameters({"gait": "walk", "legs": "many", "speed": 0.25})
    assert [result.successful for result in results.values()] == [True, False, True]
    assert (node.gait, node.legs, node.speed) == ("walk", 4, 0.25)
    refused = await driver.set_atomically({"gait": "crawl", "speed": 9.0})
    assert not refused.successful and node.gait == "walk"
    assert await driver.set_atomically({"gait": "crawl", "speed": 1.0}) == SetResult() and node.gait == "crawl"


async def test_an_int_is_widened_and_an_empty_list_takes_the_type_of_the_parameter(rig: Rig) -> None:
    driver = await client(rig)
    node = rig.node(Driver)
    assert await driver.set_parameters({"speed": 1, "legs": 2, "gains": [3, 4]}) == dict.fromkeys(
        ("speed", "legs", "gains"), SetResult()
    )
    assert (node.speed, node.legs, node.gains) == (1.0, 2, (3.0, 4.0)) and isinstance(node.speed, float)
    assert (await driver.set("gains", [])).successful and node.gains == ()


async def test_what_is_not_declared_is_an_error_with_the_nearest_name(rig: Rig) -> None:
    driver = await client(rig)
    with pytest.raises(ParameterNotDeclared, match="node /driver has not declared 'sped'; did you mean 'speed'"):
        await driver.get("sped")
    with pytest.raises(ParameterNotDeclared, match="'sped'"):
        await driver.describe("sped")
    assert not (await driver.set("sped", 1)).successful


async def test_a_parameter_without_a_value_is_an_error_and_left_out_of_a_dump(rig: Rig) -> None:
    driver = await client(rig)
    rig.node(Driver).declare_parameter("port", ParameterType.INTEGER)
    with pytest.raises(ParameterUninitialized, match="'port' of node /driver has no value"):
        await driver.get("port")
    assert "    port:" not in await driver.dump() and "    legs: 4\n" in await driver.dump()


async def test_nobody_there_is_told_within_the_time(rig: Rig) -> None:
    await rig.start(Node)
    nobody = ParameterClient(rig.me, "/nobody", timeout=2.0)
    with pytest.raises(ServiceUnavailable):
        await nobody.get("speed")
    assert rig.now == 2.0
    with pytest.raises(ServiceUnavailable):
        await nobody.wait(timeout=3.0)
    assert rig.now == 5.0


async def test_it_waits_for_a_node_that_is_to_come(rig: Rig) -> None:
    workers = DynamicSupervisor("workers", Child(Driver))
    await rig.start(workers)
    driver = ParameterClient(rig.me, "/driver")
    waiting = asyncio.ensure_future(driver.wait(timeout=5.0))
    await rig.advance(3.0)
    assert not waiting.done()
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.spawn(name="driver")
    await waiting
    assert rig.now == 3.0 and await driver.get("legs") == 4


async def test_it_watches_the_changes_of_that_node_only(rig: Rig) -> None:
    await rig.start(Child(Driver), Child(Driver, name="other"))
    driver = ParameterClient(rig.me, "/driver")
    changes = driver.changes()
    rig.node("other").set_parameter("legs", 2)
    rig.node("driver").set_parameters({"speed": 1.0, "legs": 6})
    change: ParameterChange = await asyncio.wait_for(anext(changes), 1.0)
    assert {one.name: one.value for one in change.changed} == {"speed": 1.0, "legs": 6}
    rig.publish(EVENTS, ParameterEvent(node="/driver"))
    assert await asyncio.wait_for(anext(changes), 1.0) == ParameterChange()
    await changes.aclose()


async def test_the_changes_end_with_the_node_that_watches(rig: Rig) -> None:
    class Watcher(Node):
        """Only watches."""

    await rig.start(Child(Driver), Child(Watcher, restart=temporary))
    changes = ParameterClient(rig.node(Watcher), "/driver").changes()
    rig.node(Watcher).stop()
    await rig.settled()
    assert [change async for change in changes] == []


# -- files ----------------------------------------------------------------------------------------------------------------------


async def test_what_is_dumped_is_loaded_into_another_node(rig: Rig, tmp_path: Path) -> None:
    await rig.start(Child(Driver), Child(Driver, name="other"))
    driver, other = ParameterClient(rig.me, "/driver"), ParameterClient(rig.me, "/other")
    await driver.set_parameters({"speed": 2, "gait": "on", "gains": [0.1, math.inf], "legs": 2})
    text = await driver.dump()
    assert yaml.safe_load(text)["/driver"]["ros__parameters"]["gait"] == "on"
    file = tmp_path / "driver.yaml"
    file.write_text(text.replace("/driver:", "/**:"), encoding="utf-8")
    results = await other.load(file)
    refused = {name: result.reason for name, result in results.items() if not result.successful}
    assert (
        list(refused) == ["start_type_description_service"] and "read-only" in refused["start_type_description_service"]
    )
    node = rig.node("other")
    assert isinstance(node, Driver)
    assert (node.speed, node.gait, node.gains, node.legs) == (2.0, "on", (0.1, math.inf), 2)
    with pytest.raises(InvalidParams, match="it has no parameters for /other"):
        await other.load(file, wildcard=False)


async def test_a_file_is_loaded_by_name_by_wildcard_and_atomically(rig: Rig, tmp_path: Path) -> None:
    driver = await client(rig)
    file = tmp_path / "p.yaml"
    file.write_text("/**:\n  ros__parameters: {legs: 6}\n/driver:\n  ros__parameters: {speed: 9.0, gait: walk}\n")
    refused = await driver.load_atomically(file)
    assert not refused.successful and rig.node(Driver).gait == "trot"
    results = await driver.load(file, wildcard=False)
    assert {name: result.successful for name, result in results.items()} == {"speed": False, "gait": True}
    assert rig.node(Driver).legs == 4
    assert (await driver.load(file))["legs"].successful and rig.node(Driver).legs == 6


VALUES = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(),
    st.text(st.characters(exclude_categories=["Cs"])),
    st.lists(st.floats(), max_size=3),
    st.lists(st.text(st.characters(exclude_categories=["Cs"]), max_size=4), max_size=3),
    st.lists(st.integers(-9, 9), max_size=3),
    st.lists(st.booleans(), max_size=3),
)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.dictionaries(st.from_regex(r"[a-zA-Z][a-z0-9]{0,3}(\.[a-z]{1,3})?", fullmatch=True), VALUES))
def test_a_parameter_file_gives_back_every_value_with_its_type(values: dict[str, Any]) -> None:
    text = parameter_file("/n", [Parameter(name, value) for name, value in values.items()])
    read = ParameterOverrides().with_text(text).for_node("/n")
    assert {name: repr(value) for name, value in read.items()} == {
        name: repr(tuple(value) if isinstance(value, list) else value) for name, value in values.items()
    }


@pytest.mark.parametrize(
    "text", ["y", "off", "1", "0x10", ".inf", "null", "~", "a: b", "# c", "", 'é\u2028\x7f\n"', "- x"]
)
def test_a_text_stays_a_text(text: str) -> None:
    written = parameter_file("/n", [Parameter("text", text)])
    assert ParameterOverrides().with_text(written).for_node("/n") == {"text": text}
    assert yaml.safe_load(written) == {"/n": {"ros__parameters": {"text": text}}}


def test_what_has_no_notation_is_named_and_left_out() -> None:
    held = [Parameter("raw", (b"\x01",), ParameterType.BYTE_ARRAY), Parameter("unset")]
    written = parameter_file("/n", held)
    assert written == "/n:\n  ros__parameters: {}\n    # raw: an array of bytes\n"
    assert not ParameterOverrides().with_text(written).for_node("/n")


# -- parameters that the class does not declare ---------------------------------------------------------------------------------


class Loose(Node):
    """Declares at run time."""

    async def on_start(self) -> None:
        self.rate = self.declare_parameter("rate", 10.0, ParameterDescriptor(description="Hz")).value


async def test_a_parameter_declared_at_run_time_takes_the_value_given_at_the_start(rig: Rig) -> None:
    await rig.start(Child(Loose, parameters={"rate": 50}), Child(Loose, name="other"))
    loose = rig.node("loose")
    assert loose.get_parameter("rate").value == 50.0 and loose.has_parameter("rate")
    assert rig.node("other").get_parameter("rate").value == 10.0
    assert not loose.has_parameter("raet")
    with pytest.raises(ParameterNotDeclared):
        loose.get_parameter("raet")


async def test_a_name_that_is_not_declared_by_the_end_of_the_start_is_still_refused(rig: Rig) -> None:
    with pytest.raises(StartFailed, match="/loose has no parameter 'raet'; did you mean 'rate'"):
        await rig.start(Child(Loose, parameters={"raet": 50}))


async def test_overrides_are_declared_by_themselves_if_the_class_says_so(rig: Rig) -> None:
    class Auto(Node):
        automatically_declare_parameters_from_overrides = True

    await rig.start(Child(Auto, parameters={"rate": 50, "group.name": "x"}))
    auto = rig.node(Auto)
    assert (auto.get_parameter("rate").value, auto.get_parameter("group.name").value) == (50, "x")
    assert auto.set_parameter("rate", 60).successful
    with pytest.raises(ParameterNotDeclared):
        auto.set_parameter("other", 1)


async def test_a_node_that_allows_undeclared_parameters_declares_what_is_set(rig: Rig) -> None:
    class Open(Node):
        allow_undeclared_parameters = True

    await rig.start(Open)
    client = ParameterClient(rig.me, "/open")
    assert await client.get("anything") is None
    assert (await client.set("anything", [1, 2])).successful
    assert rig.node(Open).get_parameter("anything").value == (1, 2)
    assert (await client.set("anything", None)).successful and not rig.node(Open).has_parameter("anything")


@pytest.mark.parametrize(
    ("option", "refused"),
    [("", True), ("allow_undeclared_parameters", False), ("automatically_declare_parameters_from_overrides", False)],
)
@pytest.mark.virtual
async def test_a_tree_refuses_unknown_parameters_before_it_runs_unless_a_class_may_have_them(
    option: str, refused: bool
) -> None:
    kind = type("Picky", (Node,), {option: True} if option else {})
    if refused:
        with pytest.raises(ValueError, match="there is no parameter 'rate'"):
            run(kind, parameters={"picky": {"rate": 1}}, sinks=())
    else:
        async with run(kind, parameters={"picky": {"rate": 1}}, sinks=()) as system:
            assert system.running
    async with run(Loose, parameters={"loose": {"rate": 1}}, sinks=()) as system:
        assert system.node(Loose).rate == 1.0
