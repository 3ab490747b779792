"""`python -m robot`, and programs for `python -c`, in processes of their own that need not import the same 1,400 modules anew.

One process imports what the command line and the robot import, and is forked for every command. A fork does all else that `python -m robot` does:
it has its own words, environment, folder and output, and its own end. A test of imports, of signals at the start or of the seed of hashes starts
an interpreter instead.
"""

from __future__ import annotations

import asyncio
import atexit
import gc
import json
import os
import pkgutil
import runpy
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[1]
LATE = (
    "actors.transport.bridge", "actors.transport.zenoh.transport", "actors.transport.keyed.participant", "actors.transport.dds.transport", "mujoco",
    "zenoh.ext", "cyclonedds.builtin", "cyclonedds.dynamic", "cyclonedds.qos_provider", "anyio.to_thread", "anyio._backends._asyncio",
)  # fmt: skip
"""What is imported only when it is used."""
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""As `robot run` sets them; too late for a numpy that is there already."""


class Program:
    """A command that runs, and whose output is read when it has ended."""

    def __init__(self, *words: str, env: Mapping[str, str] | None = None, cwd: Path | None = None) -> None:
        self._words = words
        self._out, self._err = (tempfile.TemporaryFile() for _ in range(2))  # noqa: SIM115  # `wait` closes them
        self._told = _begun(words, env, cwd, self._out.fileno(), self._err.fileno())
        self.pid = _hear(self._told)

    def wait(self, timeout: float) -> subprocess.CompletedProcess[str]:
        """How it has ended, and what it has printed. It is killed after `timeout` seconds."""
        self._told.settimeout(timeout)
        with self._told, self._out, self._err:
            try:
                status = _hear(self._told)
            except TimeoutError:
                self.kill()
                raise subprocess.TimeoutExpired(self._words, timeout) from None
            for file in (self._out, self._err):
                file.seek(0)
            printed = (file.read().decode() for file in (self._out, self._err))
            return subprocess.CompletedProcess(self._words, os.waitstatus_to_exitcode(status), *printed)

    def kill(self) -> None:
        """End it at once. Only while it is waited for."""
        os.kill(self.pid, signal.SIGKILL)


class Process:
    """A command whose output is read while it runs; as `asyncio.subprocess.Process` with two pipes."""

    def __init__(self, *words: str, env: Mapping[str, str] | None = None, cwd: Path | None = None) -> None:
        self.stdout, self.stderr = asyncio.StreamReader(), asyncio.StreamReader()
        self.returncode: int | None = None
        self._ended = asyncio.Event()
        pipes = [os.pipe() for _ in range(2)]
        self._ours = [os.fdopen(ours, "rb", 0) for ours, _ in pipes]
        self._told = _begun(words, env, cwd, *(theirs for _, theirs in pipes))
        for _, theirs in pipes:
            os.close(theirs)
        self.pid = _hear(self._told)

    async def _listen(self) -> None:
        loop = asyncio.get_running_loop()
        loop.add_reader(self._told, self._end)
        for reader, file in zip((self.stdout, self.stderr), self._ours, strict=True):
            await loop.connect_read_pipe(partial(asyncio.StreamReaderProtocol, reader), file)

    def _end(self) -> None:
        asyncio.get_running_loop().remove_reader(self._told)
        with self._told:
            self.returncode = os.waitstatus_to_exitcode(_hear(self._told))
        self._ended.set()

    async def wait(self) -> int | None:
        """Its exit code; waits for the end."""
        await self._ended.wait()
        return self.returncode

    async def communicate(self) -> tuple[bytes, bytes]:
        """The rest of its output; waits for the end."""
        out, err = await asyncio.gather(self.stdout.read(), self.stderr.read())
        await self.wait()
        return out, err

    def send_signal(self, number: int) -> None:
        """Harmless if it has ended."""
        if self.returncode is None:
            os.kill(self.pid, number)

    async def close(self) -> None:
        """End it at once, if it has not ended, and read the rest of what it printed."""
        self.send_signal(signal.SIGKILL)
        await self.communicate()


async def start(*words: str, env: Mapping[str, str] | None = None, cwd: Path | None = None) -> Process:
    """Start what `run` runs. To be closed."""
    process = Process(*words, env=env, cwd=cwd)
    await process._listen()
    return process


def _begun(
    words: tuple[str, ...], env: Mapping[str, str] | None, cwd: Path | None, out: int, err: int
) -> socket.socket:
    """Have a fork begin; the socket that tells its id, and in the end its status."""
    told, theirs = socket.socketpair()
    with theirs:
        request = json.dumps([words, dict(os.environ if env is None else env), str(cwd or Path.cwd())]).encode()
        socket.send_fds(_door(), [request], [out, err, theirs.fileno()])
    return told


def _hear(told: socket.socket) -> int:
    number = told.recv(4)
    if not number:
        raise EOFError("the process that is forked for commands has ended")
    return int.from_bytes(number, "little")


def run(
    *words: str, env: Mapping[str, str] | None = None, cwd: Path | None = None, timeout: float = 300.0
) -> subprocess.CompletedProcess[str]:
    """What ``python -m robot`` does with these words, or ``python -c`` with the words after "-c". It is killed after `timeout` seconds."""
    return Program(*words, env=env, cwd=cwd).wait(timeout)


@cache
def _door() -> socket.socket:
    """Where the process that is forked gets its requests. It ends when this one closes it."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with theirs:
        command = [sys.executable, "-m", "tests.warm", str(theirs.fileno())]
        quiet, own = subprocess.DEVNULL, {**os.environ, **ONE_THREAD}
        process = subprocess.Popen(command, cwd=ROOT, env=own, stdin=quiet, stdout=quiet, pass_fds=[theirs.fileno()])

    def end() -> None:
        ours.close()
        process.wait()

    atexit.register(end)
    return ours


def _serve(door: socket.socket) -> list[str]:
    """Fork for every request. Returns in the forks, as one of them: the words of its command."""
    while True:
        request, files, *_ = socket.recv_fds(door, 1 << 20, 3)
        if not request:
            os._exit(0)
        if not os.fork():
            return _begin(request, *files)
        for file in files:
            os.close(file)
        with suppress(ChildProcessError):  # there is none
            while os.waitpid(-1, os.WNOHANG)[0]:
                pass


def _begin(request: bytes, out: int, err: int, answer: int) -> list[str]:
    """Fork once more, wait for that fork and tell its end; in the fork, become the process that was asked for."""
    pid = os.fork()
    if pid:
        with socket.socket(fileno=answer) as asker:
            asker.send(pid.to_bytes(4, "little"))
            asker.send(os.waitpid(pid, 0)[1].to_bytes(4, "little"))
        os._exit(0)
    words, environment, folder = json.loads(request)
    for file, number in ((out, 1), (err, 2)):
        os.dup2(file, number)
    for file in (out, err, answer):
        os.close(file)
    os.environ.clear()
    os.environ.update(environment)
    time.tzset()
    os.chdir(folder)
    sys.path[:1] = [folder, *filter(None, environment.get("PYTHONPATH", "").split(os.pathsep))]
    return list(words)


def _import_all() -> None:
    """Import what most commands import. Nothing that starts a thread: a fork would have its locks, and not the thread."""
    for name in ("cli.verbs", "cli.graph", "robot.commands", "robot.assembly", "robot.run", "robot.nodes", "robot.sim"):
        module = import_module(name)
        for found in pkgutil.walk_packages(getattr(module, "__path__", ()), f"{name}."):
            import_module(found.name)
    for name in LATE:
        with suppress(ImportError):  # of an extra
            import_module(name)
    gc.collect()
    gc.freeze()


def _main() -> None:
    with socket.socket(fileno=int(sys.argv[1])) as door:
        _import_all()
        words = _serve(door)
    if words[:1] == ["-c"]:
        _, code, *others = words
        sys.argv = ["-c", *others]
        sys.modules["__main__"] = module = ModuleType("__main__")
        exec(compile(code, "<string>", "exec"), vars(module))
    else:
        sys.argv = ["robot", *words]
        runpy.run_module("robot", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    _main()
