"""What a process on another machine tells its tree: everything that it can tell arrives, and nothing of it is executed."""

from __future__ import annotations

import os
import pickle
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from actors import Child, Node
from actors.errors import ProcessDied, ProcessHung, RemoteError
from actors.hosts.events import UnreadableEvent, read_event
from actors.hosts.host import HostLost
from actors.hosts.messages import Launched, ProcessEnded, from_agent, written
from actors.logs.levels import Level
from actors.processes.messages import Event, Line, NodeFacts, Nodes, Over, Ready, Told
from actors.processes.pickling import pack
from actors.supervision.reasons import Failed, Killed, Returned, Stopped
from actors.supervision.refs import ChildRef
from actors.supervision.report import Report
from tests.actors.hosts.test_tls import Quiet

FACTS = NodeFacts(("top", "a"), Child(Quiet, name="a"), "running", 2, 1, ((1.5, "it failed"),), None, 7, b"saved")


@pytest.mark.parametrize(
    "event",
    [
        Ready(),
        Over(Returned(), 3),
        Over(Stopped("enough"), declined=True),
        Over(Killed(None)),
        Line(1.0, Level.INFO, "a", 1, "says", {"x": 1, "all": [1.5, "two", None, b"3", (4,), {"five"}]}, 2, "trace"),
        Told(Report("progress", ("top",), ChildRef(("top", "a"), 1), "permanent", 2.0)),
        Nodes((FACTS,), (("top", "b"),)),
    ],
    ids=lambda event: type(event).__name__,
)
def test_what_a_process_tells_arrives_as_it_was(event: Event) -> None:
    assert read_event(pack(event)) == event


def test_errors_arrive_with_class_text_notes_cause_and_attributes() -> None:
    try:
        try:
            raise KeyError("inner")
        except KeyError as inner:
            raise HostLost("base", 3.0) from inner
    except HostLost as error:
        event: Any = read_event(pack(Over(Failed(error))))
    told = event.reason.error
    assert (type(told), str(told), told.host) == (
        HostLost,
        "host base is lost: its lease of 3 s was not renewed",
        "base",
    )
    assert (type(told.__cause__), told.__cause__.args) == (KeyError, ("inner",))
    assert any("test_events.py" in note for note in told.__notes__)
    missing: Any = read_event(pack(Over(Failed(FileNotFoundError(2, "No such file", "/x")))))
    assert str(missing.reason.error) == str(FileNotFoundError(2, "No such file", "/x"))
    remote: Any = read_event(pack(Over(Failed(RemoteError("Odd", "text")))))
    assert (type(remote.reason.error), remote.reason.error.kind) == (RemoteError, "Odd")


def test_an_error_of_a_class_that_is_not_loaded_here_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from email import errors

    data = pack(Over(Failed(errors.MessageError("lost"))))
    monkeypatch.delitem(sys.modules, "email.errors")
    event: Any = read_event(data)
    assert (type(event.reason.error), str(event.reason.error)) == (RemoteError, "MessageError: lost")
    assert "email.errors" not in sys.modules
    for other in (SystemExit(3), KeyboardInterrupt()):
        event = read_event(pack(Over(Failed(other))))
        assert type(event.reason.error) is RemoteError


def test_a_factory_that_is_no_class_of_nodes_here_is_a_node() -> None:
    for factory in (Quiet, Node):
        event: Any = read_event(pack(Nodes((FACTS.__class__(("a",), Child(factory, name="a"), "running", 1),))))
        assert event.changed[0].child.factory is factory
    event = read_event(pack(Nodes((NodeFacts(("a",), Child(os.getcwd, name="a"), "running", 1),))))
    assert event.changed[0].child.factory is Node


class Evil:
    def __init__(self, *how: Any) -> None:
        self._how = how

    def __reduce__(self) -> Any:
        return self._how


def forged(proof: Path) -> list[Any]:
    call = Evil(os.system, (f"touch {proof}",))
    evaluated = Evil(eval, (f"open({str(proof)!r}, 'w')",))
    return [
        call,
        Line(1.0, 20, "a", 1, "says", {"x": call, "y": evaluated}),
        Over(Failed(ValueError(call))),
        Over(Evil(os.system, (f"touch {proof}",))),  # type: ignore[arg-type]
        Evil(Path, (str(proof),), None, iter([1]), iter([(1, 2)])),
        Evil(type(FACTS), (("a",), Evil(Child, (os.system,)), "running", 1)),
        Nodes((Evil(NodeFacts, (("a",), Evil(Child, (os.system,)), "running", 1)),)),  # type: ignore[arg-type]
        Evil(Evil, (os.system,), {"x": 1}),
    ]


@pytest.mark.parametrize("which", range(8))
def test_nothing_that_is_named_is_called(tmp_path: Path, which: int) -> None:
    proof = tmp_path / "ran"
    try:
        event = read_event(pickle.dumps(forged(proof)[which], 4))
    except UnreadableEvent:
        event = Ready()
    assert not proof.exists()
    if isinstance(event, Line):
        assert repr(event.fields["x"]) in ("<posix.system of another machine>", "<nt.system of another machine>")


def doubled(times: int) -> Any:
    value: Any = ()
    for _ in range(times):
        value = (value, value)
    return value


@pytest.mark.parametrize(
    "value",
    [
        5,
        Over(5),  # type: ignore[arg-type]
        Over(Failed(5)),  # type: ignore[arg-type]
        Line("x", 20, "a", 1, "e", {}),  # type: ignore[arg-type]
        Line(1.0, 20, "a", 1, "e", {1: 2}),  # type: ignore[dict-item]
        Line(1.0, 20, "a", 1, "e", []),  # type: ignore[arg-type]
        Nodes((NodeFacts(("a",), Child(Node, name="a"), "flying", 1),)),  # type: ignore[arg-type]
        Nodes((NodeFacts(("a",), Child(Node, name="a"), "running", 1, 0, ((1.0,),)),)),  # type: ignore[arg-type]
        Nodes([]),  # type: ignore[arg-type]
        Over(Killed(doubled(60))),
        doubled(60),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_is_no_event_is_refused(value: Any) -> None:
    with pytest.raises(UnreadableEvent):
        read_event(pack(value))


def test_nothing_is_remembered_or_set_beyond_the_event() -> None:
    remembered = b"\x80\x04Nr\xff\xff\xff\x3f."  # None, to be remembered as number 2**30
    named = b"\x80\x04\x8c\x19actors.processes.messages\x8c\x04Line\x93"
    set_on_it = named + b"N}\x8c\x07__str__N" + b"s\x86b."
    begun = time.process_time()
    for data in (remembered, set_on_it):
        with pytest.raises(UnreadableEvent):
            read_event(data)
    assert time.process_time() - begun < 1.0
    assert callable(Line.__str__)


def test_bytes_that_are_no_pickle_are_refused() -> None:
    for data in (b"", b"no pickle", pack(Ready())[:-3], b"\x80\x04P1\n.", b"\x80\x04\x8c\x01aQ."):
        with pytest.raises(UnreadableEvent):
            read_event(data)


def test_how_a_process_has_ended_arrives() -> None:
    for how in (ProcessDied(7, "exit code 0"), ProcessHung(7, 5.0, "in spin")):
        told = from_agent(written(ProcessEnded(1, how)))
        assert isinstance(told, ProcessEnded)
        assert (type(told.how), str(told.how)) == (type(how), str(how))
    failed = from_agent(written(ProcessEnded(2, FileNotFoundError(2, "none", "python"))))
    assert isinstance(failed, ProcessEnded)
    assert str(failed.how) == "FileNotFoundError: [Errno 2] none: 'python'"
    assert from_agent(written(Launched(1, 2))) == Launched(1, 2)
