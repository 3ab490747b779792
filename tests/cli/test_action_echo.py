"""`action echo`: what an action server and its clients tell each other, as it comes."""

from __future__ import annotations

import asyncio
import json
import signal
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from typing import Any

from actors import Child, Node, System
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.cli.conftest import Command, Start, SystemOf
from tests.cli.stage import COUNT, Counter
from tests.warm import Process
from tests.wires import wire as wire

TOLD = {"action_server_configure_introspection": "contents"}


class Client(Node):
    async def ask(self, order: int) -> None:
        async with self.send_goal(COUNT, Fibonacci.Goal(order=order)) as goal:
            await goal.ended()


@asynccontextmanager
async def echoing(system: System, start: Start, *words: str, topics: int) -> AsyncGenerator[Process]:
    """An `action echo` of /count that has subscribed to so many topics."""
    process = await start("action", "echo", "/count", *words)
    async with asyncio.timeout(30):
        while sum(_heard_elsewhere(entry) for entry in system.graph.topics.values()) < topics:
            assert process.returncode is None
            await asyncio.sleep(0.01)
        yield process


def _heard_elsewhere(entry: Any) -> bool:
    return "/_action/" in entry.name and any(not one.here for one in entry.subscriptions)


async def lines(process: Process, last: str, feedback: int = 0) -> list[str]:
    """What it prints, until a line begins so and there was so much feedback: topics are not in order with each other."""
    found: list[str] = []
    ended = False
    while not ended or sum("FEEDBACK_TOPIC" in line for line in found) < feedback:
        found.append((await process.stdout.readline()).decode())
        assert found[-1], "it has ended"
        ended = ended or found[-1].startswith(last)
    return found


async def ended(process: Process) -> tuple[int | None, str]:
    process.send_signal(signal.SIGINT)
    _, error = await process.communicate()
    return process.returncode, error.decode()


async def test_feedback_and_status_are_printed_as_they_come(system_of: SystemOf, start: Start) -> None:
    async with system_of(Counter, Client) as system:
        async with echoing(system, start, "-i", "FEEDBACK_TOPIC | status_topic", topics=2) as process:
            await system.node(Client).ask(3)
            found = await lines(process, "  status: 4", feedback=2)
            assert await ended(process) == (130, "")
    text = "".join(found)
    feedback = text[text.index("interface: FEEDBACK_TOPIC") :].split("---\n")[0]
    assert feedback.startswith("interface: FEEDBACK_TOPIC\ngoal_id:\n  uuid:\n  - ")
    assert feedback.endswith("\nfeedback:\n  sequence:\n  - 0\n  - 1\n  - 1\n")
    assert text.count("interface: FEEDBACK_TOPIC") == 2
    assert [line.split()[1] for line in found if line.startswith("  status:")] == ["2", "4"]
    assert "SERVICE" not in text


async def test_the_calls_of_an_action_are_told_by_name_if_its_server_tells_them(
    system_of: SystemOf, start: Start
) -> None:
    async with system_of(Child(Counter, parameters=TOLD), Client) as system:
        async with echoing(system, start, "--json", topics=4) as process:
            await system.node(Client).ask(3)
            found = [json.loads(line) for line in await lines(process, '{"interface":"RESULT_SERVICE"', feedback=2)]
            code, error = await ended(process)
    assert code == 130
    (line,) = error.splitlines()
    assert all(part in line for part in ("CANCEL_SERVICE", "service introspection is not enabled"))
    goal = [each for each in found if each["interface"] == "GOAL_SERVICE"]
    assert [each["info"]["event_type"] for each in goal] == ["REQUEST_RECEIVED", "RESPONSE_SENT"]
    assert [each["request"][0]["goal"] for each in goal[:1]] == [{"order": 3}]
    result = next(each for each in found if each["interface"] == "RESULT_SERVICE")
    assert (result["info"]["event_type"], result["response"][0]["status"]) == ("RESPONSE_SENT", 4)
    assert result["response"][0]["result"] == {"sequence": [0, 1, 1, 2]}
    feedback = [each["feedback"]["sequence"] for each in found if each["interface"] == "FEEDBACK_TOPIC"]
    assert feedback == [[0, 1, 1], [0, 1, 1, 2]]


async def test_echo_of_an_action_prints_columns_and_cuts_arrays(system_of: SystemOf, start: Start) -> None:
    async with system_of(Counter, Client) as system:
        async with echoing(system, start, "-i", "FEEDBACK_TOPIC", "--csv", "-l", "2", topics=1) as process:
            await system.node(Client).ask(2)
            name, columns = await lines(process, "") + await lines(process, "")
            await ended(process)
    assert name == "interface: FEEDBACK_TOPIC\n"
    assert columns.rstrip().split(",")[-3:] == ["0", "1", "..."]


async def test_what_cannot_be_echoed_is_one_line(meeting: int, system_of: SystemOf, command: Command) -> None:
    async with system_of(Counter):
        wrong = await command("action", "echo", "/count", "--interfaces", "FEEDBACK")
        assert (wrong.code, wrong.out) == (1, "")
        assert wrong.err == (
            '"FEEDBACK" is incorrect interface name. There are: GOAL_SERVICE, CANCEL_SERVICE, RESULT_SERVICE, '
            "FEEDBACK_TOPIC, STATUS_TOPIC\n"
        )
        absent = await command("action", "echo", "/nobody")
        assert (absent.code, absent.err) == (
            1,
            "nobody serves /nobody, so its type is not known: give it after the action\n",
        )
