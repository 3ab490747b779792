"""The parts of a real process, each by itself: copying, the channel, the watchdog, the preparation, and the private network."""

from __future__ import annotations

import asyncio
import os
import select
import socket
import sys
import threading
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from actors import StartFailed
from actors.checks import create
from actors.errors import RemoteError
from actors.processes import watchdog as watchdogs
from actors.processes.channel import Channel, framed
from actors.processes.pickling import pack, unpack
from actors.processes.preparation import environment, preparation, prepare
from actors.processes.rendezvous import Rendezvous
from actors.processes.watchdog import Watchdog
from actors.system import System
from actors.transport.zenoh import ZenohTransport
from tests.actors.processes.kit import until


class Broken(Exception):
    """Its class takes something else than what it says."""

    def __init__(self, device: int, *, why: str) -> None:
        super().__init__(f"device {device}: {why}")
        self.device = device


def raised(error: Exception) -> Exception:
    try:
        raise error
    except Exception as caught:
        return caught


# -- copying ------------------------------------------------------------------------------------------------------------------


def test_values_are_copied() -> None:
    value = {"a": (1, 2.5), "b": ["x", None]}
    assert unpack(pack(value)) == value


def test_an_error_is_copied_with_its_attributes_cause_and_traceback() -> None:
    error = Broken(3, why="gone")
    error.__cause__ = FileNotFoundError(2, "no such file", "/dev/video0")
    copy = unpack(pack(raised(error)))
    assert (type(copy), str(copy), copy.device) == (Broken, "device 3: gone", 3)
    assert (type(copy.__cause__), str(copy.__cause__)) == (FileNotFoundError, str(error.__cause__))
    (note,) = copy.__notes__
    assert note.startswith(f"In process {os.getpid()}:")
    assert "in raised" in note and "Broken: device 3: gone" in note
    assert not hasattr(copy.__cause__, "__notes__")


def test_a_traceback_is_told_once_however_many_processes_an_error_passes() -> None:
    once = unpack(pack(raised(Broken(3, why="gone"))))
    twice = unpack(pack(raised(once)))
    assert twice.__notes__ == once.__notes__


def test_an_error_within_another_value_is_copied_too() -> None:
    failed = StartFailed(("top", "a"), "it is broken")
    (copy,) = unpack(pack([failed]))
    assert (copy.path, str(copy)) == (("top", "a"), str(failed))


def test_an_error_whose_class_is_not_known_elsewhere_is_told_by_name() -> None:
    class Local(Exception):
        pass

    copy = unpack(pack(raised(Local("only here"))))
    assert isinstance(copy, RemoteError)
    assert str(copy).endswith("Local: only here")
    assert copy.kind.endswith("Local")
    assert str(RemoteError("Local", "")) == "Local"


def test_an_error_that_holds_what_cannot_be_copied_is_told_by_its_text() -> None:
    copy = unpack(pack(OSError(lambda: 1)))
    assert isinstance(copy, RemoteError)
    assert copy.kind == "OSError"


# -- the channel --------------------------------------------------------------------------------------------------------------


async def ends(first: Channel, second: Channel) -> None:
    loop = asyncio.get_running_loop()
    for channel, end in zip((first, second), socket.socketpair(), strict=True):
        await loop.create_connection(lambda channel=channel: channel, sock=end)  # type: ignore[misc]


async def test_values_arrive_in_order_and_the_end_is_told_once() -> None:
    got: list[Any] = []
    here, there = Channel(got.append, lambda: got.append("lost")), Channel(got.append, lambda: None)
    there.send("before it is open: nobody gets it")
    assert there.unsent == 0
    there.close()
    await ends(here, there)
    for value in (1, "x" * 300_000, Broken(1, why="two")):
        there.send(value)
    there.close()
    there.send("after its end: nobody gets it")
    await until(lambda: got and got[-1] == "lost")
    assert got[0] == 1 and len(got[1]) == 300_000 and isinstance(got[2], Broken) and len(got) == 4


async def test_a_frame_may_arrive_byte_by_byte() -> None:
    got: list[Any] = []
    channel = Channel(got.append, lambda: None)
    for byte in framed({"a": 1}) + framed(2):
        channel.data_received(bytes([byte]))
    assert got == [{"a": 1}, 2]


async def test_what_the_other_end_does_not_read_waits() -> None:
    here, there = Channel(lambda value: None, lambda: None), socket.socketpair()
    await asyncio.get_running_loop().create_connection(lambda: here, sock=there[0])
    here.send("x" * 4_000_000)
    assert here.unsent > 1_000_000
    there[1].close()
    here.close()
    await asyncio.sleep(0.01)


# -- the watchdog ----------------------------------------------------------------------------------------------------------------


def guard_runs() -> bool:
    return "robactor watchdog" in [thread.name for thread in threading.enumerate()]


def test_what_a_loop_hangs_in_is_noted_once_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdogs, "NOTED_SECONDS", 0.02)
    monkeypatch.setattr(watchdogs, "_LOOK", 0.005)
    ours, theirs = socket.socketpair()
    notes, noting = os.pipe()
    told = iter(["first", "second"])
    watchdog = Watchdog(theirs.fileno(), noting, lambda: next(told))
    watchdog.start()
    assert not select.select([notes], [], [], 0.05)[0]  # its loop has not begun to turn
    watchdog.turned()
    assert os.read(notes, 100) == b"first\n"
    assert not select.select([notes], [], [], 0.05)[0]
    watchdog.turned()
    assert os.read(notes, 100) == b"second\n"
    watchdog.turned()
    assert os.read(notes, 100) == b"not known: StopIteration()\n"  # the watchdog outlives what it calls
    assert guard_runs()
    watchdog.stop()
    while guard_runs():
        threading.Event().wait(0.01)
    for end in (ours, theirs):
        end.close()
    os.close(notes)
    os.close(noting)


def test_when_the_parent_is_gone_a_process_has_some_time_to_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdogs, "ORPHAN_SECONDS", 0.05)
    ours, theirs = socket.socketpair()
    over = threading.Event()
    watchdog = Watchdog(theirs.fileno(), 0, str, over.set)
    watchdog.start()
    assert not over.wait(0.2)
    ours.close()
    assert over.wait(30.0)
    watchdog.stop()
    theirs.close()


def test_a_process_that_ends_in_time_is_not_ended_by_its_guard(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdogs, "ORPHAN_SECONDS", 30.0)
    ours, theirs = socket.socketpair()
    over = threading.Event()
    watchdog = Watchdog(theirs.fileno(), 0, str, over.set)
    ours.close()
    watchdog.start()
    watchdog.stop()
    while "robactor watchdog" in [thread.name for thread in threading.enumerate()]:
        threading.Event().wait(0.01)
    assert not over.is_set()
    theirs.close()


# -- the preparation ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def untouched(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """What a preparation changes is as before after the test."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "argv", list(sys.argv))
    monkeypatch.setenv("PYTHONPATH", "before")
    for name in ("__main__", "__mp_main__"):
        monkeypatch.setitem(sys.modules, name, sys.modules["__main__"])
    return monkeypatch


def test_a_process_finds_this_library_and_has_the_environment_of_its_parent(untouched: pytest.MonkeyPatch) -> None:
    assert environment()["PYTHONPATH"].endswith(f"{os.pathsep}before")
    given = preparation(main=False)
    assert given.main == ""
    sys.path.clear()
    os.environ["PYTHONPATH"] = "elsewhere"
    prepare(given)
    assert tuple(sys.path) == given.path
    assert os.environ["PYTHONPATH"] == "before"
    untouched.delenv("PYTHONPATH")
    given = preparation(main=False)
    os.environ["PYTHONPATH"] = "elsewhere"
    prepare(given)
    assert "PYTHONPATH" not in os.environ


def test_a_process_begins_in_the_directory_of_its_parent_if_that_is_still_there(
    untouched: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    there = tmp_path / "there"
    there.mkdir()
    untouched.chdir(there)
    given = preparation(main=False)
    os.chdir(tmp_path)
    prepare(given)
    assert Path.cwd() == there
    there.rmdir()
    given = preparation(main=False)
    os.chdir(tmp_path)
    prepare(given)
    assert Path.cwd() == tmp_path


def test_what_a_process_is_likely_to_need_is_imported_beforehand_and_what_is_missing_is_left_to_those_who_need_it(
    untouched: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "heavy_to_import.py").write_text("")
    (tmp_path / "not_importable.py").write_text("raise OSError('no such device')")
    sys.path.insert(0, str(tmp_path))
    try:
        prepare(preparation(main=False, modules=("no_such_module", "not_importable", "heavy_to_import")))
        assert "heavy_to_import" in sys.modules
        assert not {"no_such_module", "not_importable"} & sys.modules.keys()
    finally:
        sys.modules.pop("heavy_to_import", None)


@pytest.mark.parametrize("how", ["script", "module"])
def test_the_main_module_of_the_parent_is_run_under_another_name(
    untouched: pytest.MonkeyPatch, tmp_path: Path, how: str
) -> None:
    (tmp_path / "its_program.py").write_text("name = __name__\n")
    sys.path.insert(0, str(tmp_path))
    main = ModuleType("__main__")
    if how == "script":
        main.__file__ = str(tmp_path / "its_program.py")
    else:
        main.__spec__ = ModuleSpec("its_program", None)
    untouched.setitem(sys.modules, "__main__", main)
    prepare(preparation(main=True))
    assert vars(sys.modules["__main__"])["name"] == "__mp_main__"
    assert sys.modules["__main__"] is sys.modules["__mp_main__"]


# -- the private network ------------------------------------------------------------------------------------------------------


async def test_processes_of_a_system_without_a_transport_meet_in_a_network_of_their_own() -> None:
    system = create(System, sinks=())
    rendezvous = Rendezvous(system.runtime, None)
    make = unpack(pack(rendezvous.sibling()))
    assert isinstance(make(), ZenohTransport)
    first = asyncio.ensure_future(rendezvous.open())
    await asyncio.gather(first, rendezvous.open())
    assert len(system.runtime.observers.closing) == 1
    await system.runtime.leave()


async def test_processes_of_a_system_with_a_transport_join_its_network() -> None:
    from actors.transport.zenoh import ZenohConfig

    system = create(System, sinks=())
    transport = ZenohTransport(
        ZenohConfig(gossip_port=0, listen=("tcp/127.0.0.1:7999",), connect=("tcp/10.0.0.1:7447",))
    )
    rendezvous = Rendezvous(system.runtime, transport)
    await rendezvous.open()
    assert system.runtime.observers.closing == []
    (config,) = rendezvous.sibling().args  # type: ignore[attr-defined]
    assert config == ZenohConfig(gossip_port=0, connect=("tcp/10.0.0.1:7447", "tcp/127.0.0.1:7999"))
    (config,) = ZenohTransport(ZenohConfig(listen=("tcp/0.0.0.0:7448",))).sibling().args  # type: ignore[attr-defined]
    assert config == ZenohConfig()
