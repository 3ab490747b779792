"""`service` and `action`: who serves what, one call, one goal."""

from __future__ import annotations

import asyncio
import json
import re
import signal

import pytest

from actors import Child, Node, Steps
from actors.interfaces.example_interfaces.action import Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from tests.cli import stage
from tests.cli.conftest import Command, Start, SystemOf
from tests.cli.stage import Adder, Counter
from tests.wires import wire as wire

ADD = ("service", "call", "/add_two_ints", "example_interfaces/srv/AddTwoInts")
COUNT = ("action", "send_goal", "/count", "example_interfaces/action/Fibonacci")


async def test_services_are_listed_with_types_and_found_by_them(
    system_of: SystemOf, command: Command, robot: Command
) -> None:
    async with system_of(Adder):
        listed = (await command("service", "list", "-t")).out
        assert "/add_two_ints [example_interfaces/srv/AddTwoInts]\n" in listed
        assert "/adder/get_parameters [rcl_interfaces/srv/GetParameters]\n" in listed
        assert (await command("service", "list", "-c")).out == f"{listed.count(chr(10))}\n"
        assert (await command("service", "type", "/add_two_ints")).out == "example_interfaces/srv/AddTwoInts\n"
        assert (await command("service", "find", "example_interfaces/srv/AddTwoInts")).out == "/add_two_ints\n"
        info = await command("service", "info", "/add_two_ints")
        assert info.out == "Type: example_interfaces/srv/AddTwoInts\nClients count: 0\nServices count: 1\n"
        verbose = (await command("service", "info", "/add_two_ints", "-v")).out
        assert "Node name: adder\n" in verbose
        assert "Service type hash: RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a\n" in verbose
        unknown, nobody = await asyncio.gather(
            robot("service", "info", "/add_two_int"), robot("service", "type", "/nobody")
        )
        assert (unknown.code, unknown.err) == (1, "Unknown service '/add_two_int'; did you mean '/add_two_ints'?\n")
        assert nobody.code == 1


async def test_a_call_prints_request_and_response(system_of: SystemOf, command: Command) -> None:
    async with system_of(Adder):
        called = await command(*ADD, "{a: 1, b: 2}")
        assert (called.code, called.err) == (0, "")
        assert called.out == (
            "requester: making request: example_interfaces.srv.AddTwoInts_Request(a=1, b=2)\n\n"
            "response:\nexample_interfaces.srv.AddTwoInts_Response(sum=3)\n\n"
        )
        as_json = json.loads((await command(*ADD, "{a: 1, b: 2}", "--json")).out)
        assert as_json == {"request": {"a": 1, "b": 2}, "response": {"sum": 3}}


async def test_a_call_that_fails_is_one_line_with_the_reason_and_ends_with_1(
    system_of: SystemOf, command: Command
) -> None:
    async with system_of(Adder):
        failed = await command(*ADD, "{a: -1}")
        assert failed.code == 1
        assert failed.err.startswith("Exception while calling service: ")
        assert "only what is positive is added" in failed.err
        wrong = await command(*ADD, "{a: 1, c: 2}")
        assert (wrong.code, wrong.out) == (1, "")
        assert wrong.err.startswith("Failed to populate field: AddTwoInts_Request: ")
        absent = await command("service", "call", "/add_two_int", ADD[3], "--timeout", "0.3")
        assert (absent.code, absent.out) == (1, "waiting for service to become available...\n")
        assert "nobody serves /add_two_int now; did you mean" in absent.err
        message = await command("service", "call", "/add_two_ints", "std_msgs/msg/String", "{}")
        assert message.code == 1
        assert message.err.startswith("The passed service type is invalid: ")


async def test_a_call_of_a_name_that_nobody_serves_says_so_and_names_the_nearest_when_that_has_come(
    system_of: SystemOf, start: Start
) -> None:
    process = await start("service", "call", "/add_two_int", ADD[3], "{a: 1}")
    async with asyncio.timeout(60):
        alone = (await process.stderr.readline()).decode()
        async with system_of(Adder):
            near = (await process.stderr.readline()).decode()
            process.send_signal(signal.SIGINT)  # while the server is there: what the end of it changes is told, too
            out, err = await process.communicate()

    assert alone == "nobody serves /add_two_int now\n"
    assert near.startswith("nobody serves /add_two_int now; did you mean ")
    assert (out, process.returncode) == (b"waiting for service to become available...\n", 130)
    for line in err.splitlines():  # a nearer name may have come meanwhile
        assert line.startswith(b"nobody serves /add_two_int now")


async def test_calls_can_be_repeated_at_a_rate_until_the_reader_goes(system_of: SystemOf, start: Start) -> None:
    async with system_of(Adder):
        process = await start(*ADD, "{a: 2, b: 2}", "-r", "50", "--json")
        async with asyncio.timeout(30):
            lines = [await process.stdout.readline() for _ in range(3)]
            process.send_signal(signal.SIGTERM)
            _, error = await process.communicate()
    assert [json.loads(line)["response"] for line in lines] == [{"sum": 4}] * 3
    assert (process.returncode, error) == (143, b"")


async def test_service_echo_says_that_nobody_tells_of_calls(system_of: SystemOf, start: Start) -> None:
    async with system_of(Adder):
        process = await start("service", "echo", "/add_two_ints")
        async with asyncio.timeout(30):
            said = await process.stderr.readline()
            process.send_signal(signal.SIGINT)
            await process.communicate()
    assert said.decode() == (
        "No publishers on topic '/add_two_ints/_service_event'; is service introspection on the client or server enabled?\n"
    )
    assert process.returncode == 130


async def test_actions_are_listed_with_types_and_with_those_who_serve_them(
    system_of: SystemOf, command: Command
) -> None:
    async with system_of(Child(Counter, namespace="arm")):
        assert (await command("action", "list")).out == "/arm/count\n"
        assert (await command("action", "list", "-t")).out == "/arm/count [example_interfaces/action/Fibonacci]\n"
        assert (await command("action", "list", "-c")).out == "1\n"
        assert (await command("action", "type", "/arm/count")).out == "example_interfaces/action/Fibonacci\n"
        assert (await command("action", "find", "example_interfaces/action/Fibonacci")).out == "/arm/count\n"
        info = await command("action", "info", "/arm/count", "-t")
        assert info.out == (
            "Action: /arm/count\nAction clients: 0\nAction servers: 1\n"
            "    /arm/counter [example_interfaces/action/Fibonacci]\n"
        )
        absent = await command("action", "info", "/nobody")
        assert (absent.code, absent.out) == (0, "Action: /nobody\nAction clients: 0\nAction servers: 0\n")
        node = (await command("node", "info", "/arm/counter")).out
        hidden = (await command("node", "info", "/arm/counter", "--include-hidden")).out
        assert "  Action Servers:\n    /arm/count: example_interfaces/action/Fibonacci\n" in node
        assert "_action" not in node
    assert "    /arm/count/_action/send_goal: example_interfaces/action/Fibonacci_SendGoal\n" in hidden


async def test_a_goal_is_followed_to_its_result(system_of: SystemOf, command: Command) -> None:
    async with system_of(Counter):
        silent = await command(*COUNT, "{order: 3}")
        followed = await command(*COUNT, "{order: 3}", "--feedback")
    goal_id = re.search(r"Goal accepted with ID: ([0-9a-f]{32})\n", followed.out)
    assert goal_id is not None
    assert (followed.code, followed.err) == (0, "")
    assert followed.out == (
        "Waiting for an action server to become available...\n"
        "Sending goal:\n     order: 3\n\n"
        f"Goal accepted with ID: {goal_id[1]}\n\n"
        "Feedback:\n    sequence:\n- 0\n- 1\n- 1\n\n"
        "Feedback:\n    sequence:\n- 0\n- 1\n- 1\n- 2\n\n"
        "Result:\n    sequence:\n- 0\n- 1\n- 1\n- 2\n\n"
        "Goal finished with status: SUCCEEDED\n"
    )
    assert "Feedback" not in silent.out


@pytest.mark.parametrize(
    ("order", "said", "reason"),
    [
        (-1, "Goal was rejected.\n", "order is negative\n"),
        (20, "Goal finished with status: ABORTED\n", "that is enough\n"),
    ],
)
async def test_a_goal_without_success_ends_with_1_and_with_0_as_ros_2_has_it(
    order: int, said: str, reason: str, system_of: SystemOf, command: Command
) -> None:
    async with system_of(Counter):
        ours = await command(*COUNT, f"{{order: {order}}}")
        theirs = await command(*COUNT, f"{{order: {order}}}", "--ros2-exit-codes")
    assert (ours.code, theirs.code) == (1, 0)
    assert ours.out.endswith(said)
    assert ours.err == theirs.err == reason


class Endless(Node):
    """Never reaches its goals, so that there is time to cancel them on a busy machine, too."""

    canceled = 0

    @stage.COUNT.serve()
    async def count(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        try:
            while True:
                yield Fibonacci_Feedback(sequence=[0, 1])
                await self.clock.sleep(0.05)
        except BaseException:
            self.canceled += 1
            raise


async def test_ctrl_c_cancels_the_goal(system_of: SystemOf, start: Start) -> None:
    async with system_of(Endless) as system:
        process = await start(*COUNT, "{order: 6}", "-f")
        async with asyncio.timeout(30):
            while b"Feedback" not in await process.stdout.readline():
                pass
            process.send_signal(signal.SIGINT)
            out, error = await process.communicate()
        assert system.node(Endless).canceled == 1
    assert out.decode().endswith("Canceling goal...\nGoal canceled.\n")
    assert (process.returncode, error) == (130, b"")


async def test_an_action_that_nobody_serves_is_waited_for_as_long_as_was_said(meeting: int, command: Command) -> None:
    late = await command("action", "send_goal", "/nobody", *COUNT[3:], "{}", "--timeout", "1", "--spin-time", "0.1")
    assert (late.code, late.out) == (1, "Waiting for an action server to become available...\n")
    assert late.err == "Action server is not available after waiting 1 seconds.\n"
