"""`lifecycle`: managed nodes of other processes, and their states."""

from __future__ import annotations

import asyncio
import json

from actors import Child
from tests.cli.conftest import Command, SystemOf
from tests.cli.stage import Camera, Talker
from tests.wires import wire as wire


async def test_only_managed_nodes_are_listed(system_of: SystemOf, command: Command) -> None:
    async with system_of(Camera, Talker, Child(Camera, name="_hidden")):
        assert (await command("lifecycle", "nodes")).out == "/camera\n"
        assert (await command("lifecycle", "nodes", "-a")).out == "/_hidden\n/camera\n"
        assert (await command("lifecycle", "nodes", "-c")).out == "1\n"


async def test_a_node_is_led_through_its_states(system_of: SystemOf, command: Command) -> None:
    async with system_of(Camera):
        assert (await command("lifecycle", "get", "/camera")).out == "unconfigured [1]\n"
        possible = await command("lifecycle", "list", "/camera")
        assert possible.out == (
            "- configure [1]\n\tStart: unconfigured\n\tGoal: configuring\n"
            "- shutdown [5]\n\tStart: unconfigured\n\tGoal: shuttingdown\n"
        )
        done = await command("lifecycle", "set", "/camera", "configure")
        assert (done.code, done.out) == (0, "Transitioning successful\n")
        assert (await command("lifecycle", "get")).out == "/camera: inactive [2]\n"
        assert (await command("lifecycle", "set", "camera", "3")).code == 0
        assert json.loads((await command("lifecycle", "get", "/camera", "--json")).out) == {
            "/camera": {"label": "active", "id": 3}
        }


async def test_a_transition_that_is_not_possible_is_answered_with_those_that_are(
    system_of: SystemOf, robot: Command
) -> None:
    async with system_of(Camera, Talker):
        refused, absent, plain = await asyncio.gather(
            robot("lifecycle", "set", "/camera", "activate"),
            robot("lifecycle", "get", "/camra"),
            robot("lifecycle", "get", "/talker"),
        )
        assert (refused.code, refused.out) == (1, "")
        assert refused.err == ("Unknown transition requested, available ones are:\n- configure [1]\n- shutdown [5]\n")
        assert (absent.code, absent.err) == (1, "Node not found; did you mean '/camera'?\n")
        assert plain.code == 1
        assert plain.err.startswith("/talker is no managed node")
