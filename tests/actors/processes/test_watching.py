"""What is seen of a process, and what becomes of it: loops that hang, memory that runs out, logs that nobody reads, a parent that is gone."""

from __future__ import annotations

import asyncio
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from actors import Child, Node, Service, Supervisor, Topic, every, open_node
from actors.errors import ProcessDied, ProcessHung
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger
from actors.logs import LogRecord
from actors.supervision import Failed
from tests.actors.processes.kit import PATIENCE, Diary, alive, in_order, running, until

pytestmark = pytest.mark.realtime

DO = Service(Trigger, "do")
BULKY = Topic(String, "bulky")


class Victim(Node):
    """Does to its process what it was made for, when it is asked to. It writes down that it ticks."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self.what = what
        self.ticks = 0

    @every(hz=50)
    def tick(self) -> None:
        self.ticks += 1

    @DO.serve()
    async def do(self, request: Any) -> Any:
        getattr(self, f"_{self.what}")()
        return Trigger.Response(success=True, message=str(self.ticks))

    def on_error(self, error: Exception, handler: str) -> Any:
        return "fail"

    def _loop(self) -> None:
        while True:
            pass

    def _pause(self) -> None:
        time.sleep(0.6)

    def _eat(self) -> None:
        limit = 512 * 1024 * 1024 + int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        hoard: list[bytearray] = []
        while True:
            hoard.append(bytearray(1024 * 1024))

    def _chatter(self) -> None:
        for number in range(20_000):
            self.log.info("chatter", number=number, text="x" * 1000)

    def _odd(self) -> None:
        self.log.info("odd", what=self.do, plain=1)

    def _exit(self) -> None:
        sys.exit(7)

    def _vanish(self) -> None:
        os._exit(3)

    def _raise(self) -> None:
        class Local(Exception):
            pass

        raise Local("only known here")


def tree(what: str, **options: Any) -> Supervisor:
    return Supervisor("top", children=[Child(Victim, args=(what,), process=True, **options)])


async def ask(system: Any) -> str:
    """Ask the victim to do it; the text of the answer, or of the error."""
    async with open_node("asker", system=system) as asker:
        try:
            return (await asker.call(DO, Trigger.Request(), timeout=PATIENCE)).message
        except Exception as error:
            return f"{type(error).__name__}: {error}"


def reasons(system: Any) -> list[Exception]:
    return [each.reason.error for each in system.reports if isinstance(each.reason, Failed)]


async def test_the_end_of_a_process_is_seen_within_100_ms(diary: Diary) -> None:
    async with running(Supervisor("top", children=in_order(diary, "a"))) as system:
        begun = time.monotonic()
        os.kill(diary.processes("a")[0], signal.SIGKILL)
        while len(system.reports) < 2:
            await asyncio.sleep(0.001)
        assert time.monotonic() - begun < 0.1
        await until(lambda: system.nodes["top", "a"].state == "running")


async def test_an_endless_loop_is_named_after_300_ms_and_killed_after_hang(diary: Diary) -> None:
    lines: list[LogRecord] = []
    async with running(tree("loop", hang=1.0), lines) as system:
        begun = time.monotonic()
        asking = asyncio.create_task(ask(system))
        await until(lambda: any("does not turn" in line.event for line in lines))
        named = time.monotonic() - begun
        await until(lambda: reasons(system))
        killed = time.monotonic() - begun
        await asking
        (line,) = (line for line in lines if "does not turn" in line.event)
        assert line.node == "top/victim"
        assert (
            "/victim" in line.fields["doing"]
            and "Victim.do" in line.fields["doing"]
            and "_loop" in line.fields["doing"]
        )
        assert 0.25 < named < 0.7
        assert 0.9 < killed < 1.6
        (error,) = reasons(system)
        assert isinstance(error, ProcessHung)
        assert "_loop" in str(error)
        await until(lambda: system.nodes["top", "victim"].incarnation == 2)


async def test_a_loop_that_turns_again_in_time_is_named_and_goes_on() -> None:
    lines: list[LogRecord] = []
    async with running(tree("pause"), lines) as system:
        await ask(system)
        await until(lambda: any("turns again" in line.event for line in lines))
        assert any("_pause" in str(line.fields.get("doing")) for line in lines)
        assert reasons(system) == []


async def test_a_process_whose_memory_runs_out_is_restarted_and_the_others_go_on(diary: Diary) -> None:
    children = [*in_order(diary, "a"), Child(Victim, args=("eat",), process=True)]
    async with running(Supervisor("top", children=children)) as system:
        await ask(system)
        await until(lambda: reasons(system))
        (error,) = reasons(system)
        assert isinstance(error, (MemoryError, ProcessDied))
        await until(
            lambda: system.nodes["top", "victim"].incarnation == 2 and system.nodes["top", "victim"].state == "running"
        )
        assert len(diary.processes("a")) == 1


async def test_log_lines_that_the_parent_does_not_read_are_counted_and_hold_nobody_up() -> None:
    lines: list[LogRecord] = []
    async with running(tree("chatter"), lines) as system:
        asking = asyncio.create_task(ask(system))
        await asyncio.sleep(0.1)  # the request is on its way
        time.sleep(2.0)  # noqa: ASYNC251  # the parent reads nothing meanwhile
        await asking
        await until(lambda: any(line.event == "log lines were lost" for line in lines) or len(lines) > 20_000)
        got = [line.fields["number"] for line in lines if line.event == "chatter"]
        lost = sum(line.fields["lines"] for line in lines if line.event == "log lines were lost")
        assert got == sorted(got)
        if lost:  # the system's own line about a handler that takes so long may be lost, too
            assert lost + len(got) <= 20_001
        assert reasons(system) == []
        assert system.nodes["top", "victim"].incarnation == 1


async def test_a_field_that_cannot_be_copied_comes_home_as_text() -> None:
    lines: list[LogRecord] = []
    async with running(tree("odd"), lines) as system:
        await ask(system)
        await until(lambda: any(line.event == "odd" for line in lines))
        (line,) = (line for line in lines if line.event == "odd")
        assert "Victim.do" in str(line.fields["what"])


async def test_a_node_that_exits_the_program_ends_the_whole_tree_with_its_code() -> None:
    with pytest.raises(SystemExit) as caught:
        async with running(tree("exit")) as system:
            await ask(system)
            await system.wait()
            assert system.exit_code == 7
    assert caught.value.code == 7


async def test_a_process_that_ends_by_itself_has_died() -> None:
    async with running(tree("vanish")) as system:
        await ask(system)
        await until(lambda: reasons(system))
        assert str(reasons(system)[0]).endswith("exit code 3")
        await until(lambda: system.nodes["top", "victim"].incarnation == 2)


async def test_a_crash_comes_home_with_its_traceback_even_if_its_class_is_not_known_here() -> None:
    async with running(tree("raise")) as system:
        await ask(system)
        await until(lambda: reasons(system))
        (error,) = reasons(system)
        assert "Local: only known here" in str(error)
        assert "in _raise" in "".join(error.__notes__)
        await until(lambda: system.nodes["top", "victim"].incarnation == 2)


PROGRAM = """
import asyncio, sys
from actors import Supervisor, run
from tests.actors.processes.kit import Diary, in_order
from pathlib import Path

async def main():
    diary = Diary(Path(sys.argv[1]))
    inner = Supervisor("inner", process=True, children=in_order(diary, "b", "c", c={"cleanup": 0.1}))
    async with run(Supervisor("top", children=[*in_order(diary, "a", "deaf", deaf={"deaf": True}), inner])) as system:
        Path(sys.argv[2]).touch()
        await system.wait()
    sys.exit(system.exit_code)

if __name__ == "__main__":
    asyncio.run(main())
"""


async def test_when_the_parent_is_killed_all_processes_end_their_nodes_in_order_and_are_gone(
    diary: Diary, tmp_path: Path
) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    parent = subprocess.Popen(  # noqa: ASYNC220
        [sys.executable, str(program), str(diary.path), str(runs := tmp_path / "running")],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )
    pids: list[int] = []
    try:
        await until(runs.exists)
        pids = [diary.processes(name)[0] for name in ("a", "b", "c", "deaf")]
        parent.kill()
        parent.wait()
        begun = time.monotonic()
        await until(lambda: not any(alive(pid) for pid in pids[:3]))
        assert time.monotonic() - begun < 1.5
        assert {"end a", "end b", "end c"} <= set(diary.lines("end"))
        await until(lambda: not alive(pids[3]))
        assert time.monotonic() - begun < 6.0
    finally:
        parent.kill()
        parent.wait()
        for pid in filter(alive, pids):
            os.kill(pid, signal.SIGKILL)


@pytest.mark.parametrize(
    "numbers",
    [
        (signal.SIGINT,),
        (signal.SIGTERM, signal.SIGTERM),  # as `timeout` does
        (signal.SIGHUP, signal.SIGCONT),  # as a terminal that is closed does
    ],
    ids=lambda numbers: numbers[0].name,
)
async def test_a_signal_to_all_processes_is_for_the_parent_which_stops_them_in_order(
    numbers: tuple[signal.Signals, ...], diary: Diary, tmp_path: Path
) -> None:
    program = tmp_path / "program.py"
    program.write_text(PROGRAM.replace(', "deaf", deaf={"deaf": True}', ""))
    parent = subprocess.Popen(  # noqa: ASYNC220
        [sys.executable, str(program), str(diary.path), str(runs := tmp_path / "running")],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
        start_new_session=True,
        stderr=subprocess.DEVNULL,
    )
    try:
        await until(runs.exists)
        pids = [diary.processes(name)[0] for name in "abc"]
        for number in numbers:
            os.killpg(parent.pid, number)
        await until(lambda: parent.poll() is not None)
        assert parent.returncode == 128 + numbers[0]
        assert diary.lines("stop", "end") == ["stop c", "end c", "stop b", "end b", "stop a", "end a"]
        assert not any(alive(pid) for pid in pids)
    finally:
        parent.kill()
        parent.wait()


SCRIPT = """
import asyncio
from actors import Child, Node, Supervisor, run

class Mine(Node):
    async def on_start(self):
        self.log.info("here", module=type(self).__module__)

async def main():
    lines = []
    async with run(Child(Mine, process=True), sinks=(lines.append,)) as system:
        print([line.event for line in lines if line.node == "/mine"], [record.state for record in system.nodes.values()])

if __name__ == "__main__":
    asyncio.run(main())
"""


@pytest.mark.parametrize("how", ["script", "module"])
async def test_nodes_of_a_script_can_have_processes_of_their_own(tmp_path: Path, how: str) -> None:
    (tmp_path / "mine.py").write_text(SCRIPT)
    arguments = ["mine.py"] if how == "script" else ["-m", "mine"]
    done = subprocess.run(  # noqa: ASYNC221
        [sys.executable, *arguments], cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert (done.stdout, done.stderr) == ("['here'] ['running']\n", "")
