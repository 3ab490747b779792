"""`top`: the table from what processes tell, its width, its JSON, and a running program seen from another one."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from actors.transport.figures import LeaseFigures, NodeFigures, ProcessFigures
from actors.typing import NodeView
from cli.verbs.top import Watch, table
from tests.cli.conftest import Command, Start

LONG = "/a_namespace_that_does_not_end/and_a_node_whose_name_is_long_too"


def node(name: str, **figures: Any) -> NodeFigures:
    given = {"state": "running", "incarnation": 1, "restarts": 0, "handled": 0, "waiting": 0, "inbox_age": 0.0}
    return NodeFigures(name=name, **{**given, **figures})


def process(*nodes: NodeFigures, **figures: Any) -> ProcessFigures:
    given = {"host": "base", "process": 7, "session": "a", "program": "robot", "memory": 200_000_000, "unreadable": 0}
    return ProcessFigures(nodes=nodes, **{**given, "at": 10.0, "cpu": 1.0, **figures})


def elsewhere(name: str, host: str = "", of: int = 0, session: str = "") -> NodeView:
    return NodeView(name, "", "elsewhere", 0, 0, host=host, process=of, session=session)


def told(*all: ProcessFigures) -> Watch:
    watch = Watch()
    for one in all:
        watch.take(one, 0.0)
    return watch


def test_rates_and_cpu_follow_from_two_reports_on_the_senders_clock() -> None:
    watch = told(process(node("/gait", handled=100)), process(node("/gait", handled=400), at=12.0, cpu=1.5))
    ((host,),) = [watch.hosts([], 0.0)]
    assert (host.host, host.processes[0].process, host.processes[0].cpu) == ("base", 7, 0.25)
    assert host.processes[0].nodes[0].rate == 150.0


def test_the_first_report_has_no_rates_and_neither_has_a_node_that_is_new() -> None:
    watch = told(process(node("/gait")))
    assert (watch.hosts([], 0.0)[0].processes[0].cpu, watch.hosts([], 0.0)[0].processes[0].nodes[0].rate) == (
        None,
        None,
    )
    watch.take(process(node("/gait"), node("/new", handled=9), at=11.0), 0.0)
    assert [row.rate for row in watch.hosts([], 0.0)[0].processes[0].nodes] == [0.0, None]


def test_processes_of_ros2_which_tell_nothing_are_counted_by_their_identity() -> None:
    nodes = [elsewhere("/a", session="1"), elsewhere("/b", session="1"), elsewhere("/c", session="2")]
    ((host,),) = [told().hosts(nodes, 0.0)]
    assert [[row.name for row in one.nodes] for one in host.processes] == [["/a", "/b"], ["/c"]]
    assert next(table([host], 60)) == "hosts 1, processes 2, nodes 3"


def test_what_nobody_tells_is_shown_as_not_known_and_last() -> None:
    watch = told(process(node("/gait")))
    hosts = watch.hosts([elsewhere("/talker"), elsewhere("/gait", "base", 7), elsewhere("/arm", "base", 3)], 0.0)
    assert [(host.host, [one.process for one in host.processes]) for host in hosts] == [
        ("base", [3, 7]),
        (None, [None]),
    ]
    assert list(table(hosts, 60))[2:] == [
        "base",
        "  3 -                         -      -",
        "    /arm                                      -       -    -",
        "  7 robot                     -    200",
        "    /gait                                     -     0.0    0",
        "-",
        "  - -                         -      -",
        "    /talker                                   -       -    -",
    ]


def test_a_process_that_is_silent_for_too_long_is_not_shown() -> None:
    watch = told(process(node("/gait")))
    assert watch.hosts([], 3.4) != []
    assert watch.hosts([], 3.6) == []


def test_hidden_nodes_and_processes_with_nothing_else_are_shown_only_if_asked_for() -> None:
    one = process(node("/_robactor_cli_1"))
    assert told(one).hosts([elsewhere("/_hidden")], 0.0) == []
    watch = Watch(hidden=True)
    watch.take(one, 0.0)
    assert [row.name for row in watch.hosts([], 0.0)[0].processes[0].nodes] == ["/_robactor_cli_1"]


def test_below_the_process_of_a_tree_are_the_machines_that_it_gives_its_parts_to() -> None:
    leases = [
        LeaseFigures(host="base", left=2.84, parts=2),
        LeaseFigures(host="spare", left=1.0, parts=1),
        LeaseFigures(host="a" * 60, left=0.0, parts=1),
    ]
    watch = told(process(leases=leases))
    hosts = watch.hosts([], 0.0)
    assert list(table(hosts, 60))[4:] == [
        "    host base             lease 2.8 s, 2 parts",
        "    host spare            lease 1.0 s, 1 part",
        "    ..aaaaaaaaaaaaaaaaaaa cannot be reached",
    ]


@pytest.mark.parametrize("columns", [60, 80, 200])
def test_no_line_is_wider_than_the_terminal_and_the_end_of_a_long_name_is_kept(columns: int) -> None:
    busy = node(LONG, state="restarting", restarts=9999, handled=10**6, inbox_age=99.9)
    watch = told(process(node(LONG)), process(busy, at=11.0, cpu=9.0, unreadable=5, memory=10**10))
    lines = list(table(watch.hosts([], 0.0), columns))
    assert max(map(len, lines)) <= columns
    assert lines[0] == "hosts 1, processes 1, nodes 1"
    assert lines[4] == "    5 messages could not be read"
    assert lines[3].split()[2:] == ["800.0", "10000"]
    assert lines[5].startswith("    ..")
    assert lines[5].split()[1:] == ["(restarting)", "1000000", "99900", "9999"]


async def test_the_table_is_ready_when_all_have_told_twice_and_does_not_wait_for_ever_for_others() -> None:
    watch = told(process(node("/gait")))
    waiting = asyncio.ensure_future(watch.settled(lambda: [elsewhere("/gait", "base", 7), elsewhere("/ros")], 60.0))
    await asyncio.sleep(0)
    assert not waiting.done()
    watch.take(process(node("/gait"), at=11.0), 1.0)
    await waiting
    await watch.settled(lambda: [elsewhere("/mute", "base", 8)], 0.0)


PROGRAM = """
import asyncio
from actors import Child, Node, every, run
from actors.transport import transport_from_environment
import os

class Worker(Node):
    @every(hz=50)
    def work(self) -> None: ...

async def main():
    tree = (Child(Worker, name="worker"),)
    async with run(*tree, transport=transport_from_environment(os.environ)) as system:
        print("running", flush=True)
        await system.wait()

asyncio.run(main())
"""


async def test_a_running_program_is_seen_from_a_second_terminal(robot: Command, start: Start) -> None:
    program = await start("-c", PROGRAM)
    async with asyncio.timeout(30):
        assert await program.stdout.readline() == b"running\n"
    seen, told = await asyncio.gather(robot("top", "--once"), robot("top", "--once", "--json"))

    assert (seen.code, seen.err) == (0, "")
    lines = seen.out.splitlines()
    assert lines[0] == "hosts 1, processes 1, nodes 1"
    assert lines[3].split()[:2] == [str(program.pid), "-c"]
    assert lines[4].split()[0] == "/worker"
    (host,) = json.loads(told.out)["hosts"]
    (one,) = host["processes"]
    (worker,) = one["nodes"]
    assert one["process"] == program.pid
    assert one["memory"] > 10_000_000
    assert 0 <= one["cpu"] < 4
    assert (worker["name"], worker["state"], worker["restarts"]) == ("/worker", "running", 0)
    assert 0 < worker["rate"] < 200
