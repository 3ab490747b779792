"""`ProgramNode`: a program as a supervised process; and the command line by which a program of ROS 2 learns its names and parameters."""

from __future__ import annotations

import asyncio
import os
import shlex
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from actors.launch.errors import ProcessDied
from actors.launch.executables import Running
from actors.launch.parameters import Layer
from actors.launch.plan import NodeSpec, Process
from actors.names.names import fully_qualified
from actors.parameters.files import ALL_NODES
from actors.parameters.ros_yaml import dump_yaml
from actors.runtime.declarations import background
from actors.runtime.node import Node
from actors.supervision.reasons import ExitReason

Output = Callable[[bytes, bool], None]
"""Takes a line that a process has written, with its end, and whether it is one of stdout."""

LAST_WORDS = 1.0
"""Seconds after the end of a process for which the end of its output is waited for: those that it started and left behind hold it open."""
LINE_LIMIT = 2**20
"""The longest line of a process that is passed on as a whole, in bytes."""


class _Pipe:
    """A pipe of our own for what a process writes: asyncio's ends with the last one that holds it, and only then tells of the process's end.

    With `tty` it is a terminal to the process, which then writes line by line and in colour, if it makes that distinction.
    """

    def __init__(self, stream: asyncio.StreamReader, written: int, transport: asyncio.ReadTransport) -> None:
        self.stream = stream
        self.written = written
        """The end for the process. The code that opened the pipe closes it."""
        self._transport = transport

    @classmethod
    async def open(cls, tty: bool) -> _Pipe:
        loop = asyncio.get_running_loop()
        stream = asyncio.StreamReader(limit=LINE_LIMIT)
        read, written = _terminal() if tty else os.pipe()
        source = os.fdopen(read, "rb", 0)
        try:
            transport, _ = await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(stream), source)
        except BaseException:
            source.close()
            os.close(written)
            raise
        return cls(stream, written, transport)

    def close(self) -> None:
        """Read no more: the stream ends with what has come."""
        self._transport.close()


def _terminal() -> tuple[int, int]:
    """The two ends of a terminal that changes nothing of what is written to it."""
    import termios  # late: few processes want a terminal, and not every system has them

    ours, theirs = os.openpty()
    flags = termios.tcgetattr(theirs)
    flags[1] &= ~termios.OPOST
    termios.tcsetattr(theirs, termios.TCSANOW, flags)
    return ours, theirs


class ProgramNode(Node):
    """Runs a program. It is ready when the process has been started, and ends with it: in order for exit code 0, else with `ProcessDied`.
    What the process has started and leaves behind with its output in hand is ended, too.

    When it is to stop, the process gets SIGINT; after `sigterm_timeout` seconds SIGTERM, after `sigkill_timeout` more SIGKILL. The process
    is the leader of a group of its own, so that Ctrl-C in the terminal reaches it only by way of its supervisor.
    """

    no_replay = "runs a program, which no journal carries"

    def __init__(self, process: Process, output: Output, running: Running) -> None:
        self.process = process
        self.output = output
        self.running = running

    async def on_start(self) -> None:
        process = self.process
        if self.clock.virtual:
            raise RuntimeError(f"{shlex.join(process.cmd)} is a program of its own, which lives in real time only")
        outputs: list[_Pipe] = []
        try:
            outputs += [await _Pipe.open(process.emulate_tty)]
            outputs += [await _Pipe.open(process.emulate_tty)]
            self.child = await self._spawned(*outputs)
        except BaseException:
            for output in outputs:
                output.close()
            raise
        finally:
            for output in outputs:
                os.close(output.written)  # the process has its own
        self.pid = self.child.pid
        self._outputs = outputs
        self._readers = [
            asyncio.ensure_future(self._read(output.stream, stdout))
            for output, stdout in zip(outputs, (True, False), strict=True)
        ]
        self.running.started(self.pid)

    async def _spawned(self, stdout: _Pipe, stderr: _Pipe) -> asyncio.subprocess.Process:
        process = self.process
        options: dict[str, Any] = {
            "env": dict(process.environment),
            "cwd": process.cwd,
            "stdin": asyncio.subprocess.DEVNULL,
            "stdout": stdout.written,
            "stderr": stderr.written,
            "start_new_session": True,
        }
        if process.shell:
            return await asyncio.create_subprocess_shell(" ".join(process.cmd), **options)
        return await asyncio.create_subprocess_exec(*process.cmd, **options)

    @background
    async def wait(self) -> None:
        """Wait for the end of the process."""
        code = await self._ended()
        if code:
            raise ProcessDied(code, shlex.join(self.process.cmd))
        self.stop("the process has finished cleanly")

    async def on_stop(self, reason: ExitReason) -> None:
        if not hasattr(self, "child"):
            return  # the stop came in the midst of the start
        limits = ((signal.SIGINT, self.process.sigterm_timeout), (signal.SIGTERM, self.process.sigkill_timeout))
        for number, seconds in limits:
            if self.child.returncode is not None:
                break
            self.log.info(f"sending signal {number.name!r} to process [{self.pid}]")
            self.send(number)
            with suppress(TimeoutError):
                async with asyncio.timeout(seconds):
                    await self._ended()
        if self.child.returncode is None:
            self.log.warning(f"process [{self.pid}] ignored SIGINT and SIGTERM; sending 'SIGKILL'")
            self.send(signal.SIGKILL)
        await self._ended()

    def send(self, number: int) -> None:
        """Send a signal to the process and to those that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self.pid, number)

    async def _ended(self) -> int:
        """Wait until the process has ended and all that it wrote has been read. Returns its exit code."""
        code = await self.child.wait()
        for number in (signal.SIGTERM, signal.SIGKILL):
            _, reading = await asyncio.wait(self._readers, timeout=LAST_WORDS)
            if not reading:
                break
            self.log.info(f"process [{self.pid}] has left others behind; sending signal {number.name!r} to them")
            self.send(number)
        for output in self._outputs:
            output.close()  # which ends the reading, too, where one that has left the group still holds it
        await asyncio.gather(*self._readers)
        self.running.finished(code)
        return code

    async def _read(self, stream: asyncio.StreamReader, stdout: bool) -> None:
        while True:
            try:
                line = await stream.readline()
            except ValueError:  # longer than the limit; what was read so far is dropped
                line = b"(a line that is too long)\n"
            except OSError:  # nobody has the other end of a terminal any more
                return
            if not line:
                return
            self.output(line, stdout)


def ros_arguments(node: NodeSpec, folder: Path) -> list[str]:
    """The arguments of a program that is a node of ROS 2. Parameters are written to files in `folder`.

    The order is that of ROS 2: its own arguments, those for ROS, the name, the namespace, the parameters, the remappings.
    """
    words = [*node.arguments, "--ros-args", *node.ros_arguments]
    if node.name is not None:
        words += ["-r", f"__node:={node.name}"]
    if node.namespace:
        words += ["-r", f"__ns:={node.namespace}"]
    target = fully_qualified(node.namespace, node.name) if node.name is not None and node.namespace else ALL_NODES
    for layer in node.layers:
        words += _parameter_arguments(layer, target, folder)
    for old, new in node.remaps:
        words += ["-r", f"{old}:={new}"]
    return words


def _parameter_arguments(layer: Layer, target: str, folder: Path) -> Sequence[str]:
    text = layer.text
    if text is None:
        if not layer.values:
            return ()
        text = dump_yaml({layer.pattern or target: {"ros__parameters": dict(layer.values)}})
    path = folder / f"launch_params_{sum(1 for _ in folder.iterdir())}.yaml"
    path.write_text(text, encoding="utf-8")
    return ("--params-file", str(path))
