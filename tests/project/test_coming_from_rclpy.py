"""docs/howto/port-from-rclpy.md: our twenty programs do what stands there; the other halves are Python.

`python -m tests.interop.ros2 'twenty programs'` runs those with ROS 2.
"""

from __future__ import annotations

import ast
import asyncio
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from actors import execute
from actors.bag import BagReader
from actors.lifecycle import bring_up
from actors.testing import Rig
from tests.project.test_docs import DOCS, once
from tests.site import pairs

PAGE = (DOCS / "howto/port-from-rclpy.md").read_text(encoding="utf-8")
SECTIONS = {
    int(number): text
    for number, text in re.findall(r"^## (\d+)\. .*?\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
}
THEIRS = pairs.FILE.read_text(encoding="utf-8")


@pytest.fixture
def page() -> Any:
    """The names of our halves."""
    return SimpleNamespace(**once("howto/port-from-rclpy.md"))


def test_there_are_twenty_programs_each_in_both() -> None:
    assert sorted(SECTIONS) == sorted(pairs.theirs()) == list(range(1, 21))
    for text in SECTIONS.values():
        assert re.findall(r"```(\w+)\n", text) == ["python"]


def test_the_site_shows_them_side_by_side() -> None:
    shown = re.split(r"^## ", pairs.side_by_side(PAGE), flags=re.MULTILINE)[1:21]
    assert [re.findall(r"```(\w+)\n", text) for text in shown] == [["py", "python"]] * 20


def test_the_other_halves_are_python_and_import_what_they_use() -> None:
    tree = ast.parse(THEIRS)
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    bound = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    bound |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    bound |= {node.name for node in ast.walk(tree) if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    bound |= {
        (alias.asname or alias.name).partition(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for alias in node.names
    }
    assert used - bound <= {"KeyboardInterrupt", "super", "list", "int", "len", "sum", "range"}


# -- our halves ---------------------------------------------------------------------------------------------------------------


async def test_1_2_what_is_published_is_heard_twice_a_second(page: Any, rig: Rig) -> None:
    await rig.start(page.Talker, page.Listener)
    await rig.advance(2.0)
    assert rig.node("listener").heard == ["Hello 0", "Hello 1", "Hello 2", "Hello 3"]
    assert "I heard Hello 3" in [line.event for line in rig.logs]


async def test_3_a_watchdog_barks_a_second_after_the_last_message(page: Any, rig: Rig) -> None:
    await rig.start(page.Watchdog)
    for _ in range(5):
        rig.publish(page.CHATTER, page.String(data="pat"))
        await rig.advance(0.9)
    assert rig.node("watchdog").alarms == 0
    await rig.advance(5.0)
    assert rig.node("watchdog").alarms == 1


def test_4_5_a_script_asks_and_waits(page: Any) -> None:
    assert page.ask_and_wait(2, 3) == 5


async def test_6_a_callback_asks_and_goes_on(page: Any, rig: Rig) -> None:
    await rig.start(page.Adder, page.Doubler)
    for number in (1.0, 2.0, 3.0):
        rig.publish(page.NUMBERS, page.Float64(data=number))
    await rig.quiet()
    assert rig.node("doubler").sums == [2, 4, 6]


async def test_7_a_newer_goal_takes_the_place_of_the_older_one(page: Any, rig: Rig) -> None:
    await rig.start(page.Counter)
    first = await rig.send_goal(page.COUNT, page.Fibonacci.Goal(order=50))
    await rig.advance(0.35)
    second = await rig.send_goal(page.COUNT, page.Fibonacci.Goal(order=4))
    assert (await second).sequence.tolist() == [0, 1, 1, 2, 3]
    assert (await first.ended()).status.name in ("ABORTED", "CANCELED")
    third = await rig.send_goal(page.COUNT, page.Fibonacci.Goal(order=50))
    assert await third.cancel()


async def test_8_a_client_sees_feedback_and_result(page: Any, rig: Rig) -> None:
    await rig.start(page.Counter, page.Customer)
    assert await rig.node("customer").order(4) == ([1, 2, 3], [0, 1, 1, 2, 3])


async def test_9_a_value_out_of_range_is_refused_and_a_good_one_is_told(page: Any, rig: Rig) -> None:
    await rig.start(page.Driver)
    driver = rig.node("driver")
    refused = driver.set_parameter("speed", 9.0)
    assert (refused.successful, driver.speed) == (False, 0.5)
    assert driver.set_parameter("speed", 1.5).successful and driver.speed == 1.5
    assert "1.5 m/s from now on" in [line.event for line in rig.logs]


async def test_10_it_publishes_only_while_it_is_active(page: Any, rig: Rig) -> None:
    await rig.start(page.Camera)
    frames = rig.probe(page.FRAMES)
    await rig.advance(1.0)
    assert len(frames) == 0
    await bring_up(rig.system)
    await rig.advance(1.0)
    assert len(frames) == 10


async def test_11_12_profiles_are_those_of_the_contracts_and_the_map_is_latched(page: Any, rig: Rig) -> None:
    await rig.start(page.Scanner, page.MapServer)
    rig.publish(page.SCAN, page.LaserScan())
    await rig.advance(5.0)
    assert rig.node("scanner").scans == 1
    assert [message.data for message in rig.probe(page.MAP)] == ["the map"]


async def test_13_slow_answers_hold_up_neither_each_other_nor_the_timer(page: Any, rig: Rig) -> None:
    await rig.start(page.Busy)
    asked = [rig.call(page.ADD_SLOWLY, page.AddTwoInts.Request(a=number), timeout=2.0) for number in range(4)]
    assert [answer.sum for answer in await asyncio.gather(*asked)] == [0, 1, 2, 3]
    assert rig.now == 1.0
    assert rig.node("busy").ticks >= 9


def test_14_a_script_waits_for_one_message(page: Any) -> None:
    assert execute(page.wait_for_one, clock="virtual").data == "Hello 0"


async def test_15_namespace_and_remapping_are_said_where_a_node_is_placed(page: Any, rig: Rig) -> None:
    await rig.start(page.two_talkers)
    left, loud = (rig.probe(page.CHATTER, name=name) for name in ("/left/chatter", "/loud/chatter"))
    await rig.advance(1.0)
    assert len(left) == len(loud) == 2


async def test_16_the_tree_and_the_launch_file_run_the_same_nodes(page: Any, rig: Rig, tmp_path: Path) -> None:
    from actors.launch import Launch, Packages

    file = tmp_path / "talk.launch.py"
    file.write_text(pairs.theirs()[16], encoding="utf-8")
    lines = Launch(file, packages=Packages(environment={})).show().splitlines()
    assert any("talker as /ann" in line for line in lines) and any("[permanent: restarted]" in line for line in lines)
    await rig.start(page.launched)
    await rig.advance(2.0)
    assert "Received: Hello World 1" in [line.event for line in rig.logs if line.node == "/listener"]


def test_17_a_minute_is_recorded(page: Any, tmp_path: Path) -> None:
    recorded = execute(lambda: page.record(tmp_path / "minute"), clock="virtual")
    assert recorded >= 118
    with BagReader(tmp_path / "minute") as bag:
        assert len(list(bag.messages(["/chatter"]))) == recorded


async def test_19_the_last_word_is_zero_also_of_one_that_fails(page: Any, rig: Rig) -> None:
    await rig.start(page.Motor)
    speeds = rig.probe(page.SPEED)
    rig.crash(page.Motor)
    await rig.settled()
    assert speeds.last == page.Float64(data=0.0)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_19_a_signal_ends_it_without_a_traceback(number: signal.Signals, code: int) -> None:
    program = (
        "import asyncio; from tests.project.test_docs import program; page = program('howto/port-from-rclpy.md')\n"
        "from actors import run\n"
        "async def main():\n"
        "    async with run(page['Motor'], sinks=()) as system:\n"
        "        print('ready', flush=True)\n"
        "        await system.wait()\n"
        "    return system.exit_code\n"
        "raise SystemExit(asyncio.run(main()))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], cwd=DOCS.parent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    while process.stdout.readline() not in ("ready\n", ""):
        pass
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (code, "")


async def test_20_work_in_another_process_brings_its_result_home(page: Any, rig: Rig) -> None:
    await rig.start(page.Planner)
    await rig.advance(3.0)
    assert rig.node("planner").plans == [4_999_950_000] * 3


def test_every_pitfall_has_the_issue_where_people_met_it() -> None:
    cited = re.findall(
        r"\[(?:rclpy|examples|ros2)#(\d+)\]\(https://github\.com/ros2/(?:rclpy|examples|ros2)/(?:issues|pull)/(\d+)\)",
        PAGE,
    )
    assert len(cited) >= 15
    assert all(text == address for text, address in cited)
