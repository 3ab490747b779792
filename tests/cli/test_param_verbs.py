"""`param`: the parameters of nodes of other processes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from actors import Child
from tests.cli.conftest import Command, SystemOf
from tests.cli.stage import Motor, Talker
from tests.wires import wire as wire

BUILT_IN = ("start_type_description_service", "use_sim_time")


async def test_they_are_listed_by_node_with_types_and_by_a_pattern(system_of: SystemOf, command: Command) -> None:
    async with system_of(Motor, Talker):
        own = await command("param", "list", "/motor")
        assert own.out == "  gains\n  legs\n  mode\n  speed\n  start_type_description_service\n  use_sim_time\n"
        everyone = (await command("param", "list")).out
        assert everyone.startswith("/motor:\n  gains\n")
        assert "/talker:\n  start_type_description_service\n" in everyone
        typed = await command("param", "list", "motor", "--param-type", "--filter", "g|s|legs")
        assert typed.out == (
            "  gains (type: double array)\n  legs (type: integer)\n  speed (type: double)\n"
            "  start_type_description_service (type: boolean)\n"
        )


async def test_a_value_is_read_with_its_type_or_without(system_of: SystemOf, command: Command) -> None:
    async with system_of(Motor, Child(Motor, name="other", parameters={"speed": 1.5})):
        assert (await command("param", "get", "/motor", "speed")).out == "Double value is: 0.5\n"
        assert (await command("param", "get", "/motor", "gains")).out == "Double values are: [1.0, 0.1]\n"
        assert (await command("param", "get", "/motor", "use_sim_time")).out == "Boolean value is: False\n"
        assert (await command("param", "get", "/motor", "mode", "--hide-type")).out == "walk\n"
        two = await command("param", "get", "/motor", "mode", "legs")
        assert two.out == "mode:\n  String value is: walk\nlegs:\n  Integer value is: 4\n"
        everywhere = await command("param", "get", "speed")
        assert everywhere.out == "/motor:\n  Double value is: 0.5\n/other:\n  Double value is: 1.5\n"


async def test_what_is_not_there_is_said_with_the_nearest_name(system_of: SystemOf, command: Command) -> None:
    async with system_of(Talker):
        node = await command("param", "get", "/talkr", "x", "--timeout", "0")
        assert (node.code, node.err) == (1, "Node not found; did you mean '/talker'?\n")
        name = await command("param", "get", "/talker", "use_sim_tim")
        assert (name.code, name.err) == (
            1,
            "Parameter(s) 'use_sim_tim' not available on node; did you mean 'use_sim_time'?\n",
        )
        nowhere = await command("param", "get", "nothing")
        assert (nowhere.code, nowhere.out) == (0, "Parameter 'nothing' not set on any node\n")


async def test_a_set_takes_effect_and_a_refused_one_says_why_and_ends_with_1(
    system_of: SystemOf, command: Command
) -> None:
    async with system_of(Motor) as system:
        done = await command("param", "set", "/motor", "speed", "1.5")
        assert (done.code, done.out, done.err) == (0, "Set parameter successful\n", "")
        assert system.node(Motor).speed == 1.5
        refused = await command("param", "set", "/motor", "speed", "9.0")
        assert (refused.code, refused.out) == (1, "")
        assert refused.err.startswith("Setting parameter failed: ")
        assert system.node(Motor).speed == 1.5
        as_ros2 = await command("param", "set", "/motor", "speed", "9.0", "--ros2-exit-codes")
        assert as_ros2.code == 0
        fixed = await command("param", "set", "/motor", "legs", "6")
        assert fixed.code == 1
        assert "read" in fixed.err


async def test_a_list_is_set_and_several_can_be_set_at_once_or_not_at_all(
    system_of: SystemOf, command: Command
) -> None:
    async with system_of(Motor) as system:
        motor = system.node(Motor)
        assert (await command("param", "set", "/motor", "gains", "[1.5, 0.2, 0.02]")).code == 0
        assert list(motor.gains) == [1.5, 0.2, 0.02]
        assert (await command("param", "set", "/motor", "gains", "[]")).code == 0
        assert list(motor.gains) == []
        assert (await command("param", "set", "/motor", "mode", "[]")).code == 1, "a text is no list"
        several = await command("param", "set", "/motor", "speed", "1.0", "mode", "run")
        assert several.out == "speed: Set parameter successful\nmode: Set parameter successful\n"
        none = await command("param", "set", "/motor", "speed", "0.1", "legs", "6", "--atomic")
        assert none.code == 1
        assert none.err.startswith("Setting parameters atomically failed: ")
        assert (motor.speed, motor.mode) == (1.0, "run")
        odd = await command("param", "set", "/motor", "speed")
        assert odd.code == 1
        assert "name/value pairs" in odd.err


async def test_a_list_is_emptied_by_a_file(system_of: SystemOf, command: Command, tmp_path: Path) -> None:
    (tmp_path / "empty.yaml").write_text("/motor: {ros__parameters: {gains: []}}")
    async with system_of(Motor) as system:
        loaded = await command("param", "load", "/motor", str(tmp_path / "empty.yaml"))
        assert (loaded.code, list(system.node(Motor).gains)) == (0, []), loaded.err


async def test_describe_tells_type_text_and_range(system_of: SystemOf, command: Command) -> None:
    async with system_of(Motor):
        described = await command("param", "describe", "/motor", "speed", "legs")
    assert described.out == (
        "Parameter name: speed\n  Type: double\n  Description: How fast.\n  Constraints:\n"
        "    Min value: 0.0\n    Max value: 2.0\n    Additional constraints: unit: m/s\n"
        "Parameter name: legs\n  Type: integer\n  Constraints:\n    Read only: true\n"
    )


async def test_a_parameter_without_a_fixed_type_is_deleted_and_another_is_not(
    system_of: SystemOf, command: Command
) -> None:
    async with system_of(Motor):
        assert (await command("param", "set", "/motor", "extra", "5")).code == 0
        assert (await command("param", "get", "/motor", "extra")).out == "Integer value is: 5\n"
        assert (await command("param", "delete", "/motor", "extra")).out == "Deleted parameter successfully\n"
        kept = await command("param", "delete", "/motor", "speed")
        assert kept.code == 1
        assert kept.err.startswith("Deleting parameter failed")


async def test_what_is_dumped_can_be_loaded(system_of: SystemOf, command: Command, tmp_path: Path) -> None:
    path = tmp_path / "motor.yaml"
    async with system_of(Motor) as system:
        dumped = await command("param", "dump", "/motor")
        values = yaml.safe_load(dumped.out)["/motor"]["ros__parameters"]
        assert values["speed"] == 0.5
        assert values["gains"] == [1.0, 0.1]
        path.write_text("/motor:\n  ros__parameters:\n    speed: 1.25\n/**:\n  ros__parameters:\n    mode: trot\n")
        own = await command("param", "load", "/motor", str(path), "--no-use-wildcard")
        assert (own.code, own.out) == (0, "Set parameter speed successful\n")
        assert (system.node(Motor).speed, system.node(Motor).mode) == (1.25, "walk")
        assert (await command("param", "load", "/motor", str(path))).code == 0
        assert system.node(Motor).mode == "trot"
        path.write_text("/motor:\n  ros__parameters:\n    speed: 7.0\n")
        refused = await command("param", "load", "/motor", str(path))
        assert refused.code == 1
        assert refused.err.startswith("Set parameter speed failed: ")
    missing = await command("param", "load", "/motor", "nothing.yaml")
    assert missing.code == 1
    assert missing.err.count("\n") == 1


async def test_values_are_had_as_json(system_of: SystemOf, command: Command) -> None:
    async with system_of(Motor):
        assert json.loads((await command("param", "get", "/motor", "gains", "--json")).out) == {"gains": [1.0, 0.1]}
        assert json.loads((await command("param", "list", "/motor", "--json")).out)["/motor"]["speed"] == "double"
        told = json.loads((await command("param", "set", "/motor", "speed", "9.0", "--json")).out)
        assert told["speed"]["successful"] is False


@pytest.mark.parametrize("verb", ["get", "set", "describe", "delete", "dump", "load"])
async def test_without_its_words_a_verb_says_how_it_is_used(verb: str, command: Command) -> None:
    misused = await command("param", verb)
    assert misused.code == 2
    assert misused.err.startswith(f"robactor param {verb}: the following arguments are required: ")
