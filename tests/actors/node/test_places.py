"""The user's line: never one of a library while there is one of the user's, whatever lies around it."""

from __future__ import annotations

import asyncio
import importlib
import os
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from traceback import extract_tb

import anyio
import numpy as np
import pytest

from actors import CallTimeout, Child, Node, StartFailed, Supervisor, background, parameter, places, publishes, run
from actors.checks import create
from actors.errors import WrongType
from actors.places import (
    ACTORS,
    PACKAGE,
    PYTHON,
    USER,
    awaited_in,
    line_of,
    owner_of,
    place_of,
    traceback_of,
    users_trace,
)
from actors.testing import Rig
from tests.stage import NUMBERS, events, number


def raised(function: Callable[[], object]) -> BaseException:
    try:
        function()
    except BaseException as error:
        return error
    raise AssertionError("it did not raise")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], Path]]:
    """Writes a module into a folder of installed packages; its module is forgotten afterwards."""
    folder = tmp_path / "lib" / "site-packages"
    folder.mkdir(parents=True)
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    claimed: set[str] = set()
    monkeypatch.setattr("actors.places._claimed", claimed)
    names: list[str] = []

    def write(name: str, source: str) -> Path:
        (folder / name).write_text(source)
        names.append(name.removesuffix(".py"))
        importlib.invalidate_caches()
        return folder / name

    yield write
    for name in names:
        sys.modules.pop(name, None)


def test_an_error_that_passes_through_numpy_is_at_the_users_line() -> None:
    def invert() -> None:
        np.linalg.inv(np.zeros((2, 2)))

    error = raised(invert)
    assert place_of(error).startswith(f"{__file__}:")
    assert place_of(error).endswith(" in test_an_error_that_passes_through_numpy_is_at_the_users_line.<locals>.invert")


def test_a_parameter_that_is_assigned_to_is_at_the_users_line() -> None:
    class Driver(Node):
        speed = parameter(0.5)

    def assign() -> None:
        Driver().speed = 1.0  # type: ignore[misc]

    error = raised(assign)
    assert place_of(error).startswith(f"{__file__}:"), "and not in actors/parameters"


def test_an_error_that_nobody_raised_is_nowhere_and_has_no_traceback() -> None:
    assert place_of(OSError("never raised")) == ""
    assert traceback_of(OSError("never raised")) is None


def test_whose_a_file_is() -> None:
    assert owner_of(__file__) == USER
    assert owner_of("<stdin>") == USER
    assert owner_of("<check of Float32>") == owner_of("<CDR encoder of std_msgs/msg/Float32>") == ACTORS
    assert owner_of(np.__file__) == PACKAGE
    assert owner_of("/usr/lib/python3/dist-packages/yaml/__init__.py") == PACKAGE
    assert owner_of("/opt/site-packages") == USER, "a file of that name is nobody's package"
    for python in (os.__file__, asyncio.__file__, anyio.__file__, "<frozen importlib._bootstrap>"):
        assert owner_of(python) == PYTHON
    assert owner_of(places.__file__) > PYTHON


def test_without_a_line_of_the_users_a_package_is_named_and_before_python(
    installed: Callable[[str, str], Path],
) -> None:
    file = installed("digger.py", "import json\n\ndef dig():\n    json.loads('no')\n")
    dig = importlib.import_module(file.stem).dig
    error = raised(dig)
    error.__traceback__ = users_trace(error)
    assert error.__traceback__ is not None
    error.__traceback__ = error.__traceback__.tb_next  # what called it is this test
    assert place_of(error) == f"{file}:4 in dig"
    shown = traceback_of(error)
    assert shown is not None and shown.stack[0].name == "dig", "and all of it is shown"


def test_a_package_that_defines_nodes_is_the_users_wherever_it_is_installed(
    installed: Callable[[str, str], Path],
) -> None:
    source = "from actors import Node\n\nclass Mine(Node):\n    def go(self, call):\n        call()\n"
    file = installed("my_robot.py", source)
    before = owner_of(str(file))
    mine = importlib.import_module(file.stem).Mine()
    assert (before, owner_of(str(file))) == (PACKAGE, USER)
    error = raised(lambda: mine.go(lambda: np.linalg.inv(np.zeros((2, 2)))))
    assert place_of(error).startswith(f"{__file__}:"), "the innermost of the user's lines"
    assert place_of(raised(lambda: mine.go(None))) == f"{file}:5 in Mine.go"


class Brittle(Node):
    """Fails where it is told to, by way of a library."""

    @NUMBERS.on()
    def take(self, message: object) -> None:
        np.linalg.inv(np.zeros((2, 2)))

    @background
    async def wait(self) -> None:
        await asyncio.sleep(1.0)
        raise OSError("snapped")


async def test_a_traceback_begins_at_the_users_first_line_and_goes_down_into_the_library(rig: Rig) -> None:
    await rig.start(Child(Brittle))
    rig.publish(NUMBERS, number(1))
    with rig.expect_failure(np.linalg.LinAlgError) as failure:
        await rig.advance(0.5)
    (error,) = failure.errors
    shown = traceback_of(error)
    assert shown is not None
    assert [(line.filename == __file__, line.name) for line in shown.stack][:2] == [(True, "take"), (False, "inv")]
    with rig.expect_failure(OSError) as failure:
        await rig.advance(2.0)
    shown = traceback_of(failure.errors[0])
    assert shown is not None and [line.name for line in shown.stack] == ["wait"]


class Mistyped(Node):
    """Publishes what its topic does not carry."""

    out = publishes(NUMBERS)

    async def on_start(self) -> None:
        self.out("seven")  # type: ignore[arg-type]


async def test_an_error_that_actors_raised_on_purpose_ends_at_the_users_line_in_the_log_and_where_it_is_raised(
    rig: Rig,
) -> None:
    with pytest.raises(StartFailed) as failed:
        async with run(Mistyped, sinks=()) as system:
            raise AssertionError(system)
    cause = failed.value.__cause__
    assert isinstance(cause, WrongType)
    shown = traceback_of(cause)
    assert shown is not None and [line.name for line in shown.stack] == ["on_start"]
    assert [frame.name for frame in extract_tb(cause.__traceback__)] == ["on_start"]
    assert [frame.name for frame in extract_tb(failed.value.__traceback__)][1:] == ["__aenter__"]


async def test_what_rig_crash_raises_is_at_no_line_of_actors(rig: Rig) -> None:
    await rig.start(Child(Brittle))
    rig.crash(Brittle, OSError("pulled out"))
    await rig.advance(0.1)
    (line,) = events(rig.logs, "child terminated")
    assert line.fields == {"child": "system/brittle", "reason": "it raised OSError: pulled out"}
    assert line.traceback == ""


async def test_an_error_of_actors_that_never_met_the_user_says_all_by_its_text(rig: Rig) -> None:
    class Spoilt(Node):
        def __init__(self) -> None:
            self.value = 1

    await rig.start(Supervisor("system", children=[Child(Brittle), Child(Spoilt)]))
    rig.crash(Spoilt, CallTimeout("nobody answered"))
    await rig.advance(0.1)
    assert events(rig.logs, "child terminated")[0].traceback == ""


def test_what_caused_an_error_is_shown_from_the_users_line_on_and_so_are_the_members_of_a_group() -> None:
    def fail() -> None:
        try:
            np.linalg.inv(np.zeros((2, 2)))
        except np.linalg.LinAlgError as error:
            raise ExceptionGroup("several", [raised(lambda: int("x"))]) from error  # type: ignore[list-item]

    shown = traceback_of(raised(fail))
    assert shown is not None and shown.__cause__ is not None and shown.exceptions is not None
    assert shown.__cause__.stack[0].name == "fail"
    assert "invalid literal for int()" in "".join(shown.format())


def test_the_line_of_a_thread_is_that_of_what_its_loop_runs_and_not_of_who_runs_the_loop() -> None:
    lines: list[str] = []
    done = threading.Event()

    def look(thread: int) -> None:
        lines.append(line_of(thread))
        done.set()

    async def main() -> None:
        def blocked() -> None:
            threading.Thread(target=look, args=(threading.get_ident(),)).start()
            done.wait()

        asyncio.get_running_loop().call_soon(blocked)
        await asyncio.sleep(0)

    asyncio.run(main())
    assert lines[0].startswith(f"{__file__}:") and lines[0].endswith(".<locals>.blocked")


@pytest.mark.virtual
async def test_a_task_waits_at_the_users_line_also_within_actors() -> None:
    from actors.time.clock import Clock

    async def rest() -> None:
        await create(Clock, asyncio.get_running_loop(), virtual=False).sleep(5.0)

    task = asyncio.create_task(rest())
    await asyncio.sleep(0)
    assert awaited_in(task).startswith(f"{__file__}:") and awaited_in(task).endswith("rest")
    task.cancel()
    await asyncio.wait([task])
