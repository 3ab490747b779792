"""`python -m tests.tools.tutorial_pages [PAGE...]`: types the commands of docs/start/ and writes what they print into the pages.

A page is a sequence of blocks. A block ``python``, ``xml`` or ``yaml`` is a file, whose name is in the comment of its first line; it is saved in the
reader's folder. A block ``text`` is a terminal: each line that begins with ``$`` is typed there, and below it stands what it printed. A line that begins
with ``(another terminal) $`` is typed in a terminal of its own, where it runs until the page ends or the next such line that begins with ``^C``. ``^C``
at the end of an output is pressed after as many lines as stand above it.

What differs from run to run is masked when `tests/project/test_tutorial_pages.py` compares: the times of log lines, the numbers of what is measured.
"""

from __future__ import annotations

import os
import re
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import time
from argparse import ArgumentParser
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "docs" / "start"
PAGES = (
    "first-node.md",
    "first-test.md",
    "topics.md",
    "services-actions-parameters.md",
    "lifecycle-launch-supervision.md",
    "robot.md",
    "from-rclpy.md",
)
PATIENCE = 60.0
ELSEWHERE = "(another terminal) "

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_NAME = re.compile(r"\A(?:#|<!--) ([\w./]+\.(?:py|xml|yaml))")


def blocks(text: str) -> list[tuple[str, str]]:
    """The blocks of a page: their kinds and what is in them."""
    return _BLOCK.findall(text)


def earlier(page: str) -> Iterator[str]:
    """The files that a reader has saved on the pages before this one."""
    for name in PAGES[: PAGES.index(page)]:
        yield from (body for kind, body in blocks((FOLDER / name).read_text(encoding="utf-8")) if kind != "text")


def played(text: str, files: Iterable[str] = ()) -> str:
    """The page with what its commands print now, in a folder with these files."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        reader = Reader(Path(folder), stack)
        for body in files:
            reader.save(body)

        def block(match: re.Match[str]) -> str:
            kind, body = match.groups()
            if kind != "text":
                reader.save(body)
                return match[0]
            return f"```text\n{reader.terminal(body)}```"

        return _BLOCK.sub(block, text)


class Reader:
    """Who follows a page: a folder with the files so far, and the programs that run in other terminals."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder = folder
        self._stack = stack
        self._elsewhere: list[subprocess.Popen[bytes]] = []
        with socket.socket() as one:
            one.bind(("127.0.0.1", 0))
            port = str(one.getsockname()[1])
        own = {"ROBACTOR_GOSSIP_PORT": port, "ROS_DOMAIN_ID": "13", "RMW_IMPLEMENTATION": "", "AMENT_PREFIX_PATH": ""}
        path = f"{folder}{os.pathsep}{ROOT}"
        # The pages show what pytest prints when it is asked for no more.
        asked = {"COLUMNS": "100", "PYTEST_ADDOPTS": "", "PYTHONDONTWRITEBYTECODE": "1"}
        self._environment = {**os.environ, **own, **asked, "PYTHONPATH": path}

    def save(self, body: str) -> None:
        """Save a block as the file that it names."""
        if name := _NAME.match(body):
            (self._folder / name[1]).write_text(body, encoding="utf-8")

    def terminal(self, body: str) -> str:
        """The block with what is printed now."""
        lines: list[str] = []
        for command, shown in commands_of(body):
            lines.append(command)
            if command.startswith(f"{ELSEWHERE}^C"):
                self._interrupt()
            elif command.startswith(ELSEWHERE):
                self._start(command.removeprefix(f"{ELSEWHERE}$ "))
            else:
                lines += self.typed(command.removeprefix("$ "), shown)
        return "\n".join(lines).rstrip() + "\n"

    def _words(self, line: str) -> list[str]:
        programs = {"python": [sys.executable], "robactor": [sys.executable, "-m", "robot"]}
        first, *rest = shlex.split(line)
        return [*programs[first], *rest]

    def _start(self, line: str) -> None:
        """Run it beside; go on when the graph has more nodes than before."""
        before = self._nodes() if self._elsewhere else list[str]()
        process = subprocess.Popen(
            self._words(line),
            env=self._environment,
            cwd=self._folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._elsewhere.append(process)
        self._stack.callback(process.wait)
        self._stack.callback(process.terminate)
        end, seen = time.monotonic() + PATIENCE, before
        while seen == before or seen != (now := self._nodes()):  # it has nodes, and no more come
            if time.monotonic() > end or process.poll() is not None:
                raise TimeoutError(f"{line}: no node of it is there; it has ended with {process.poll()}")
            seen = self._nodes() if seen == before else now

    def _interrupt(self) -> None:
        """Press Ctrl-C in the terminal that was opened last."""
        process = self._elsewhere.pop()
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE)

    def _nodes(self) -> list[str]:
        words = [sys.executable, "-m", "robot", "node", "list"]
        return subprocess.run(words, env=self._environment, capture_output=True, text=True, check=True).stdout.split()

    def typed(self, line: str, shown: Sequence[str]) -> list[str]:
        """What a command prints; of one that is interrupted as many lines as are shown."""
        words = self._words(line)
        process = subprocess.Popen(
            words, env=self._environment, cwd=self._folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        assert process.stdout is not None
        if shown and shown[-1] == "^C":
            lines = [process.stdout.readline().rstrip() for _ in shown[:-1]]
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
            return [*map(self._anonymous, lines), "^C"]
        out = process.communicate(timeout=2 * PATIENCE)[0].rstrip()
        lines = [*map(self._anonymous, out.split("\n"))] if out else []
        return lines if process.returncode == 0 else [*lines, f"(exit code {process.returncode})"]

    def _anonymous(self, line: str) -> str:
        return line.rstrip().replace(f"{self._folder}/", "").replace(str(self._folder), "~")


def commands_of(body: str) -> Iterator[tuple[str, list[str]]]:
    """Each line of a terminal that is typed, with what stands below it."""
    command, shown = "", list[str]()
    for line in body.splitlines():
        if line.startswith(("$ ", ELSEWHERE)):
            if command:
                yield command, _without_end(shown)
            command, shown = line, []
        else:
            shown.append(line)
    if command:
        yield command, _without_end(shown)


def _without_end(lines: list[str]) -> list[str]:
    while lines and not lines[-1]:
        lines = lines[:-1]
    return lines


_TIME = re.compile(r"^ *\d+\.\d{3} (?=\[)")
_TOOK = re.compile(r"in \d+\.\d+s\b")
_NUMBER = re.compile(r"\b[0-9a-f]{32}\b|([0-9a-f]{2}\.){15}[0-9a-f]{2}|-?\d+(\.\d+)?(e-?\d+)?")
MEASURED = (
    " echo ",
    " hz ",
    " doctor ",
    " send_goal ",
    " --verbose",
    " --count-nodes ",
    " --goal ",
    " /get_battery_status ",
)
"""Commands whose numbers differ from run to run."""


def masked(page: str) -> list[str]:
    """The lines of a page without what differs from run to run."""
    lines: list[str] = []
    measured = False
    for line in page.splitlines():
        if line.startswith(("$ ", ELSEWHERE, "```")):
            measured = line.startswith("$ ") and any(word in f"{line} " for word in MEASURED)
            lines.append(line)
        else:
            line = _TOOK.sub("in N s", _TIME.sub("N ", line))
            lines.append(re.sub(r"\s+", " ", _NUMBER.sub("N", line) if measured else line))
    return lines


def main() -> None:
    """Write the pages."""
    parser = ArgumentParser(
        prog="python -m tests.tools.tutorial_pages", description="Write what the commands of docs/start print."
    )
    parser.add_argument("pages", nargs="*", metavar="PAGE", help=f"of {', '.join(PAGES)} (all)")
    for name in parser.parse_args().pages or PAGES:
        path = FOLDER / name
        path.write_text(played(path.read_text(encoding="utf-8"), earlier(name)), encoding="utf-8")
        print(f"{path.relative_to(ROOT)} is written", flush=True)


if __name__ == "__main__":
    main()
