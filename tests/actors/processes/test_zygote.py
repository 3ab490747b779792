"""A zygote imports what the processes of a tree need and forks them. It may end, be killed, or be no good: the tree does not depend on it."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from actors import Child, Node, StartFailed, Supervisor, System, run
from actors.errors import ProcessDied
from actors.logs import LogRecord
from actors.processes import forked, prefork, zygote
from actors.processes import main as mains
from actors.processes.channel import framed
from actors.processes.forked import UNKNOWN, Forked, Zygote
from actors.processes.os_process import Started, call, discard, employ, fork
from actors.processes.preparation import preparation
from actors.processes.zygote import Request, may_fork
from tests.actors.processes.kit import Diary, Scripted, alive, in_order, running, until

pytestmark = pytest.mark.skipif(not forked.can_fork(), reason="this system has no zygotes")
ROOT = Path(__file__).parents[3]


def said_of(pid: int, what: str) -> str:
    return Path(f"/proc/{pid}/{what}").read_text()


def parent_of(pid: int) -> int:
    return int(said_of(pid, "stat").rpartition(")")[2].split()[1])


def process(system: System, name: str) -> int:
    return system.nodes["tree", name].process


# -- in a tree ------------------------------------------------------------------------------------------------------------------


async def test_the_processes_of_a_tree_and_their_next_lives_are_forked_by_one_zygote(diary: Diary) -> None:
    async with running(Supervisor("tree", children=in_order(diary, "a", "b"))) as system:
        first = process(system, "a")
        zygote = parent_of(first)
        assert (parent_of(process(system, "b")), parent_of(zygote)) == (zygote, os.getpid())
        assert said_of(first, "cmdline").rstrip("\0").endswith("-m\0actors.processes.main\0tree/a")
        assert said_of(first, "comm") == "a\n"

        system.kill_process("a")
        await until(lambda: len(diary.processes("a")) == 2)
        second = diary.processes("a")[1]
        assert parent_of(second) == zygote
        assert not alive(first)
    assert not alive(zygote)


async def test_the_lives_of_a_process_leave_no_descriptor_open(diary: Diary) -> None:
    def opened() -> list[int]:
        return [len(os.listdir(f"/proc/{pid}/fd")) for pid in (os.getpid(), zygote)]

    async with running(Supervisor("tree", children=in_order(diary, "a"))) as system:
        zygote = parent_of(process(system, "a"))
        before = opened()
        for life in (2, 3):
            system.kill_process("a")
            await until(lambda life=life: diary.lines("ready").count("ready a") == life)  # type: ignore[misc]
        await until(lambda: opened() == before, "descriptors are closed")


async def test_a_zygote_that_is_killed_takes_nobody_with_it_and_the_next_lives_have_interpreters(diary: Diary) -> None:
    lines: list[LogRecord] = []
    async with running(Supervisor("tree", children=in_order(diary, "a", "b")), lines) as system:
        first, other = process(system, "a"), process(system, "b")
        os.kill(zygote := parent_of(first), signal.SIGKILL)
        await until(lambda: parent_of(first) != zygote)
        await asyncio.sleep(0.3)  # for what would follow from it
        assert alive(first) and alive(other)

        system.kill_process("a")
        await until(lambda: diary.lines("ready").count("ready a") == 2)
        assert parent_of(diary.processes("a")[1]) == os.getpid()
        assert process(system, "b") == other
        (report,) = [
            report for report in system.reports if isinstance(getattr(report.reason, "error", None), ProcessDied)
        ]
        assert "an exit code that is not known" in str(report.reason)
    assert diary.lines("end") == ["end b", "end a"]


async def test_those_whose_turn_never_comes_end_with_the_system(diary: Diary) -> None:
    children = in_order(diary, "first", "second", first={"refuse": 1_000})
    with pytest.raises(StartFailed):
        async with run(Supervisor("tree", children=children), signals=False, sinks=()):
            pass
    assert diary.lines("start") == ["start first"]


async def test_one_that_dies_before_its_turn_is_forked_again(diary: Diary, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, list[Forked]] = {}
    ask = Zygote.fork

    def noted(self: Zygote, name: str, channel: int, notes: int) -> Forked:
        asked.setdefault(name, []).append(process := ask(self, name, channel, notes))
        return process

    monkeypatch.setattr(Zygote, "fork", noted)

    class Kills(Scripted):
        """In the first process of the tree: there is none before the second child's."""

        async def on_start(self) -> None:
            await until(lambda: "tree/second" in asked)
            (waiting,) = asked["tree/second"]
            await waiting.begun()
            os.kill(waiting.pid, signal.SIGKILL)
            await until(lambda: waiting.poll() == -signal.SIGKILL)

    first, second = in_order(diary, "first", "second")
    kills = Child(Kills, name="kills", args=(str(diary.path), {}))
    async with running(Supervisor("tree", children=[first, kills, second])):
        assert diary.processes("second") == [asked["tree/second"][1].pid]


class Draws(Node):
    """Draws a number from the generator that all code of a process shares."""

    async def on_start(self) -> None:
        import numpy as np

        self.log.info("drawn", number=int(np.random.randint(1 << 62)))


async def test_no_two_processes_draw_the_same_numbers() -> None:
    lines: list[LogRecord] = []
    children = [Child(Draws, name=name, process=True) for name in ("a", "b")]
    async with running(Supervisor("tree", children=children), lines):
        await until(lambda: sum(line.event == "drawn" for line in lines) == 2)
    first, second = (line.fields["number"] for line in lines if line.event == "drawn")
    assert first != second


async def test_where_an_import_makes_forks_unsafe_each_process_is_an_interpreter(
    diary: Diary, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "has_a_thread.py").write_text(
        "import threading\nthreading.Thread(target=threading.Event().wait, daemon=True).start()\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(prefork, "MODULES", ("has_a_thread",))
    async with running(Supervisor("tree", children=in_order(diary, "a", "b"))) as system:
        assert [parent_of(process(system, name)) for name in "ab"] == [os.getpid()] * 2


async def test_a_start_that_is_given_up_leaves_no_process_that_waits(
    diary: Diary, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = asyncio.Event()

    async def never(self: Forked) -> bool:
        asked.set()
        await asyncio.Event().wait()
        return True

    monkeypatch.setattr(Forked, "begun", never)

    async def start() -> None:
        async with run(Supervisor("tree", children=in_order(diary, "a")), signals=False, sinks=()):
            pass

    starting = asyncio.create_task(start())
    await asked.wait()
    starting.cancel()
    with pytest.raises(asyncio.CancelledError):
        await starting
    assert diary.lines() == []


async def test_where_the_system_starts_no_zygote_each_process_is_an_interpreter(
    diary: Diary, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(name: str, given: object) -> Zygote:
        raise OSError("no more processes")

    monkeypatch.setattr(prefork, "zygotes", refuse)
    async with running(Supervisor("tree", children=in_order(diary, "a"))) as system:
        assert parent_of(process(system, "a")) == os.getpid()


PROGRAM = """
import os, sys, time
from pathlib import Path
from actors import Child, ExitReason, Node, Supervisor, execute, run
from actors.processes.forked import forked

class Stays(Node):
    async def on_stop(self, reason: ExitReason) -> None:
        Path(sys.argv[1]).write_text(str(reason))

async def main():
    async with run(Supervisor("tree", children=[Child(Stays, process=True)]), sinks=()) as system:
        print(system.nodes["tree", "stays"].process, flush=True)
        if sys.argv[2] == "waits":
            await system.wait()

if __name__ == "__main__":
    with forked("tree") as zygote:
        assert zygote is not None
        print(zygote.pid, flush=True)
        execute(main)
    print("over", flush=True)
"""


@pytest.fixture
def program(tmp_path: Path) -> Callable[[str], subprocess.Popen[str]]:
    (tmp_path / "its_program.py").write_text(PROGRAM)

    def start(word: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, str(tmp_path / "its_program.py"), str(tmp_path / "why"), word],
            stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip

    return start


def test_a_program_can_be_the_zygote_of_its_processes(
    program: Callable[[str], subprocess.Popen[str]], tmp_path: Path
) -> None:
    with program("ends") as running:
        assert running.stdout is not None
        zygote, child, over = running.stdout.read().split()
    assert (running.returncode, over) == (0, "over")
    assert (tmp_path / "why").read_text() == "it stopped: the block was left"
    assert not alive(int(zygote)) and not alive(int(child))


async def test_when_the_program_is_killed_its_processes_end_in_order_and_the_zygote_ends(
    program: Callable[[str], subprocess.Popen[str]], tmp_path: Path
) -> None:
    with program("waits") as running:
        assert running.stdout is not None
        zygote, child = int(running.stdout.readline()), int(running.stdout.readline())
        assert parent_of(child) == zygote
        running.kill()
        await until(lambda: not alive(zygote) and not alive(child))
    assert (tmp_path / "why").read_text() == "it stopped: its parent process is gone"


# -- one process ----------------------------------------------------------------------------------------------------------------


class Handle:
    """A process, as `Zygote` needs it: this one."""

    pid = os.getpid()

    def kill(self) -> None: ...
    def wait(self) -> None: ...


class Served:
    """A zygote whose requests are served in a thread of this process, where `os.fork` starts another program."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.ours, self.theirs = socket.socketpair()
        self.program = "exec sleep 1000"
        self.fork: Callable[[], int] = self._start
        self.parent = subprocess.Popen(["sleep", "1000"])
        self.result: list[Request | None] = []
        monkeypatch.setattr(os, "fork", lambda: self.fork())
        self.zygote = Zygote(Handle(), self.ours)  # type: ignore[arg-type]
        parent = os.pidfd_open(self.parent.pid)
        self.thread = threading.Thread(target=self._serve, args=(parent,))
        self.thread.start()

    def _serve(self, parent: int) -> None:
        serving = zygote.Zygote(self.theirs, parent)
        self.result.append(serving.serve())
        for descriptor in (parent, *serving._children, *serving._children.values()):  # as the end of a process does
            with suppress(OSError):
                os.close(descriptor)

    def _start(self) -> int:
        started = subprocess.Popen(["/bin/sh", "-c", self.program])
        started.returncode = 0  # the zygote waits for it
        return started.pid

    def ask(self) -> Started:
        return fork(self.zygote, "asked")

    def end(self) -> Request | None:
        self.thread.join()
        self.parent.kill()
        self.parent.wait()
        self.ours.close()
        self.theirs.close()
        (result,) = self.result
        return result


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Served:
    return Served(monkeypatch)


@pytest.mark.parametrize(
    ("program", "how"),
    [
        ("exit 3", "exit code 3"),
        ("kill -TERM $$", "signal SIGTERM"),
        ("kill -40 $$", "signal 40"),
        ("exit 0", "exit code 0"),
    ],
)
async def test_the_end_of_a_forked_process_is_seen_with_its_cause(served: Served, program: str, how: str) -> None:
    served.program = f"sleep 0.1; {program}"
    started = served.ask()
    assert isinstance(started.popen, Forked)
    assert await started.popen.begun()
    running = await employ(started, ("top", "asked"), 5.0, b"", lambda event: None)
    error = await asyncio.wait_for(asyncio.shield(running.ended), 30.0)
    assert str(error) == str(ProcessDied(running.id, how))
    assert started.popen.wait() == started.popen.poll()
    running.kill()
    running.terminate()
    served.zygote.close()
    assert served.end() is None


async def test_a_forked_process_whose_zygote_has_ended_is_still_seen_to_end_and_can_be_killed(served: Served) -> None:
    started = served.ask()
    assert isinstance(started.popen, Forked)
    assert await started.popen.begun()
    running = await employ(started, ("top", "asked"), 5.0, b"", lambda event: None)
    served.parent.kill()
    assert await asyncio.to_thread(served.end) is None
    assert alive(running.id)
    with pytest.raises(OSError):
        served.ask()
    await asyncio.sleep(0.1)
    assert not running.ended.done()
    running.kill()
    await asyncio.to_thread(os.waitpid, running.id, 0)  # in this test it is a child of this process
    error = await asyncio.wait_for(asyncio.shield(running.ended), 30.0)
    assert "an exit code that is not known" in str(error)
    assert started.popen.wait() == UNKNOWN


def test_a_process_that_is_still_to_be_forked_gets_no_signal_and_can_be_given_up() -> None:
    status, theirs = os.pipe()
    process = Forked(status)
    process.send_signal(signal.SIGTERM)
    assert process.poll() is None
    process.abandon()
    os.close(theirs)
    assert process.poll() == UNKNOWN


async def test_what_waits_for_an_order_is_killed_with_its_zygote(served: Served) -> None:
    given_up, waiting = served.ask(), served.ask()
    assert isinstance(given_up.popen, Forked) and isinstance(waiting.popen, Forked)
    assert await waiting.popen.begun() and await given_up.popen.begun()
    discard(given_up)
    served.zygote.close()
    assert served.end() is None
    assert waiting.popen.wait() == -signal.SIGKILL
    assert not alive(given_up.popen.pid)
    discard(waiting)


async def test_one_that_the_system_does_not_fork_has_not_begun(served: Served) -> None:
    def refuse() -> int:
        raise OSError("no more processes")

    served.fork = refuse
    started = served.ask()
    assert isinstance(started.popen, Forked)
    assert not await started.popen.begun()
    discard(started)
    served.ours.close()  # as if this process had ended
    assert served.end() is None


def test_in_the_new_process_nothing_of_the_zygote_is_open_but_what_it_was_asked_for(served: Served) -> None:
    first = served.ask()
    first.popen.kill()
    descriptors = len(os.listdir("/proc/self/fd"))
    served.fork = lambda: 0
    second = served.ask()
    request = served.end()
    assert request is not None and request.name == "asked"
    await_killed = first.popen.wait  # its zygote is gone: the descriptor of the process tells
    assert await_killed() in (-signal.SIGKILL, UNKNOWN)
    os.write(request.notes, b"a note")
    assert os.read(second.notes, 100) == b"a note"
    request.close()
    discard(first)
    discard(second)
    assert len(os.listdir("/proc/self/fd")) < descriptors


@pytest.mark.parametrize("numpy", [True, False])
def test_a_request_runs_the_order_that_comes_by_its_channel(
    served: Served, monkeypatch: pytest.MonkeyPatch, numpy: bool
) -> None:
    served.fork = lambda: 0
    started = served.ask()
    request = served.end()
    assert request is not None
    called: list[Any] = []
    monkeypatch.setattr(zygote, "call_process", called.append)
    monkeypatch.setattr(zygote, "end_with_parent", called.append)
    monkeypatch.setattr(mains, "live", lambda channel, notes, *, parent: called.append((channel, notes, parent)) or 7)
    monkeypatch.setattr(zygote.Zygote, "serve", lambda self: request)
    monkeypatch.setattr("gc.freeze", lambda: None)
    monkeypatch.delitem(sys.modules, "numpy.random", raising=False)
    if numpy:
        monkeypatch.setitem(sys.modules, "numpy.random", SimpleNamespace(seed=lambda: called.append("seeded")))
    assert zygote.run(served.theirs, 42) == 7
    assert called == ["asked", signal.SIGKILL, *(["seeded"] if numpy else []), (request.channel, request.notes, 42)]
    assert not Path(f"/proc/self/fd/{request.status}").exists()  # it is the zygote's: its end is seen by it
    os.close(request.channel)
    os.close(request.notes)
    discard(started)


def test_a_program_that_cannot_get_ready_is_no_zygote(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zygote, "leave_to_parent", lambda: None)
    monkeypatch.setattr(zygote, "run", lambda control, parent: 7)
    monkeypatch.setattr(zygote, "prepare", lambda given: None)
    for frame, may, code in ((b"", True, 1), (framed("given"), True, 7), (framed("given"), False, 1)):
        monkeypatch.setattr(zygote, "may_fork", lambda may=may: may)
        ours, theirs = socket.socketpair()
        with ours:
            ours.sendall(frame)
            ours.shutdown(socket.SHUT_WR)
            assert zygote.main([str(theirs.detach()), "42", "name"]) == code


def test_a_library_whose_threads_end_at_a_fork_does_not_make_it_unsafe(monkeypatch: pytest.MonkeyPatch) -> None:
    assert zygote._threads() >= threading.active_count()
    threads = [2, 1]
    monkeypatch.setattr(zygote, "_threads", lambda: threads.pop(0))
    reaped: list[int] = []
    monkeypatch.setattr(os, "waitpid", lambda pid, options: reaped.append(pid))
    monkeypatch.setattr(os, "fork", lambda: 42)
    assert may_fork()
    assert reaped == [42]
    threads[:] = [2, 2]
    assert not may_fork()
    threads[:] = [1, 1]
    assert may_fork()

    def end(code: int) -> None:
        raise SystemExit(code)

    threads[:] = [2]
    monkeypatch.setattr(os, "fork", lambda: 0)
    monkeypatch.setattr(os, "_exit", end)
    with pytest.raises(SystemExit):
        may_fork()


@pytest.mark.parametrize("fails", [False, True])
def test_a_fork_of_a_program_ends_without_what_the_program_would_do_next(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], fails: bool
) -> None:
    class Ended(BaseException):
        pass

    def end(code: int) -> None:
        raise Ended(code)

    def serve(control: socket.socket, parent: int) -> int:
        if fails:
            raise OSError("what an order raises")
        return 0

    called: list[Any] = []
    monkeypatch.setattr(zygote, "leave_to_parent", lambda: None)
    monkeypatch.setattr(zygote, "call_process", called.append)
    monkeypatch.setattr(zygote, "run", serve)
    monkeypatch.setattr(os, "dup2", lambda here, there: called.append(there))
    monkeypatch.setattr("atexit._run_exitfuncs", lambda: called.append("exit functions"))
    monkeypatch.setattr(os, "_exit", end)
    ours, theirs = socket.socketpair()
    with ours, pytest.raises(Ended) as ended:
        zygote.become(theirs, 42, "zygote of this")
    assert ended.value.args == (int(fails),)
    assert called == [0, "zygote of this", "exit functions"]
    assert ("what an order raises" in capsys.readouterr().err) is fails


def test_the_name_of_a_process_is_cut_to_the_room_that_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[bytes] = []

    class Memory:
        @staticmethod
        def CDLL(name: None) -> Any:
            return SimpleNamespace(prctl=lambda option, name, *rest: written.append(name))

        @staticmethod
        def memset(begin: int, value: int, size: int) -> None:
            written.append(bytes(size))

        @staticmethod
        def memmove(begin: int, data: bytes, size: int) -> None:
            written.append(data[:size])

    monkeypatch.setattr(zygote, "ctypes", Memory)
    zygote.call_process("robot/" + "x" * 100_000)
    assert written[0] == b"x" * 100_000
    _, room, shown = written
    assert shown.startswith(b"robot/xxx")
    assert len(shown) == len(room) - 1 < 100_000  # without a zero at its end, the environment would be shown, too


def exits(code: int) -> None:
    sys.exit(code)


def sleeps() -> None:
    threading.Event().wait()


def test_a_function_is_called_in_a_process_that_is_forked_where_there_is_a_zygote(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own = call("alone", partial(exits, 3))
    assert own.wait() == 3
    zygote = forked.started("test", preparation(main=False))
    monkeypatch.setattr(forked, "_here", zygote)
    assert call("fails", partial(exits, 4)).wait() == 4
    stays = call("stays", sleeps)
    stays.kill()  # as soon as it is there
    assert stays.wait() == -signal.SIGKILL
    assert call("ends", partial(exits, 0)).wait() == 0
    zygote.close()
    assert not alive(zygote.pid)


def test_a_process_is_killed_as_soon_as_its_zygote_has_told_of_it() -> None:
    told, tell = os.pipe()
    sleeper = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(100)"])

    class Late(Forked):
        def _await_news(self) -> None:
            os.write(tell, forked.NUMBER.pack(sleeper.pid))
            super()._await_news()

    late = Late(told)
    late.kill()
    assert sleeper.wait() == -signal.SIGKILL
    os.close(tell)
    late.abandon()


async def test_a_system_uses_the_zygote_of_its_program_and_leaves_it(
    diary: Diary, monkeypatch: pytest.MonkeyPatch
) -> None:
    zygote = forked.started("test", preparation(main=False))
    monkeypatch.setattr(forked, "_here", zygote)
    async with running(Supervisor("tree", children=in_order(diary, "a"))) as system:
        assert parent_of(process(system, "a")) == zygote.pid
    assert alive(zygote.pid)
    zygote.close()


def test_where_a_fork_is_not_safe_a_program_has_no_zygote(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forked, "may_fork", lambda: False)
    with forked.forked("test", ("no_such_module",)) as none:
        assert none is forked.here() is None


def test_a_program_forks_its_zygote_before_the_block_and_ends_it_after(monkeypatch: pytest.MonkeyPatch) -> None:
    program = subprocess.Popen(["sleep", "1000"])
    program.returncode = 0  # `forked` waits for it
    monkeypatch.setattr(forked, "may_fork", lambda: True)
    monkeypatch.setattr(forked, "END_SECONDS", 0.05)
    monkeypatch.setattr(os, "fork", lambda: program.pid)
    with forked.forked("test") as zygote:
        assert zygote is forked.here() is not None
        assert zygote.pid == program.pid
    assert forked.here() is None
    assert not alive(program.pid)

    def become(control: socket.socket, parent: int, name: str) -> None:
        raise SystemExit(name)

    monkeypatch.setattr(os, "fork", lambda: 0)
    monkeypatch.setattr(forked, "become", become)
    with pytest.raises(SystemExit, match="zygote of test"), forked.forked("test"):
        pass


def test_a_zygote_that_cannot_be_prepared_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: socket.socket, data: bytes) -> None:
        raise BrokenPipeError

    monkeypatch.setattr(socket.socket, "sendall", refuse)
    with pytest.raises(BrokenPipeError):
        forked.started("test", preparation(main=False))
