"""What is imported when: nothing heavy by `import actors`, and nothing heavy while a loop ticks on the real clock."""

from __future__ import annotations

import subprocess
import sys
import textwrap

import pytest

HEAVY = {
    "numpy",
    "structlog",
    "anyio._backends._asyncio",
    "anyio.to_thread",
    "actors.runtime.sim_time",
    "actors.interfaces.cdr",
}

PROGRAM = """
import asyncio, sys
from actors import Node, Supervisor, Child, Topic, blocking, every, execute, open_node, publishes, run
from actors.interfaces.sensor_msgs.msg import Imu
from actors.interfaces.rcl_interfaces.msg import ParameterEvent

SEEN = []

class Busy(Node):
    out = publishes(Topic(Imu, "imu"))
    ticks = 0

    @every(hz=100)
    def tick(self):
        self.ticks += 1
        if self.ticks == 2:
            self.out(Imu())
            self.log.info("first line")
            self.set_parameter("use_sim_time", True)
        SEEN.append(self.ticks)

async def ticking():
    before = set(sys.modules)
    while len(SEEN) < 2:
        await asyncio.sleep(0.01)
    print(*sorted(set(sys.modules) - before))
"""


def answer(code: str) -> set[str]:
    """The words that a fresh interpreter prints."""
    script = PROGRAM + textwrap.dedent(code)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.replace("first line", "").split("###")[-1].split())


def test_importing_actors_brings_nothing_heavy() -> None:
    assert HEAVY & answer("print('###', *sys.modules)") == set()


@pytest.mark.parametrize(
    "code",
    [
        """
        async def main():
            async with run(Supervisor("s", children=[Child(Busy)])):
                print("###")
                await ticking()
        asyncio.run(main())
        """,
        """
        async def main():
            async with run(Supervisor("s", children=[Child(Busy)]), sinks=()):
                print("###")
                await ticking()
        execute(main)
        """,
        """
        async def main():
            async with open_node("script") as node:
                before = set(sys.modules)
                Imu()
                node.log.info("first line")
                await asyncio.sleep(0)
                print("###", *sorted(set(sys.modules) - before))
        asyncio.run(main())
        """,
    ],
    ids=["run", "execute", "open_node"],
)
def test_nothing_heavy_is_imported_while_a_real_loop_ticks(code: str) -> None:
    assert HEAVY & answer(code) == set()


def test_execute_imports_before_the_loop_and_the_virtual_clock_only_what_it_needs() -> None:
    code = """
    async def main():
        print("###", *sys.modules)
    execute(main, clock={clock!r})
    """
    assert "numpy" in answer(code.format(clock="real"))
    assert not {"numpy", "structlog"} & answer(code.format(clock="virtual"))


def test_structlog_is_left_out_where_no_line_goes_to_it() -> None:
    code = """
    async def main():
        async with run(Supervisor("s", children=[Child(Busy)]), sinks=()):
            print("###", *sys.modules)
    asyncio.run(main())
    """
    loaded = answer(code)
    assert "numpy" in loaded and "structlog" not in loaded
