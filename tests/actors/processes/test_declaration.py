"""What ``process=True`` asks of a declaration: it must be possible to copy it to another process."""

from __future__ import annotations

import math
import sys
from types import ModuleType
from typing import Any

import pytest

from actors import Child, DeclarationError, DynamicSupervisor, Node, Supervisor
from actors.checks import create
from actors.supervision.errors import StartFailed
from actors.system import System
from actors.testing import Rig


class Camera(Node):
    def __init__(self, *args: Any) -> None:
        super().__init__()


class Unreadable:
    """It can be written to bytes, and not read from them."""

    def __reduce__(self) -> Any:
        return int, ("no number",)


def test_one_word_is_enough() -> None:
    child = Child(Camera, process=True)
    assert (child.process, child.hang) == (True, 5.0)
    assert repr(child) == "Child(Camera, name='camera', process=True)"
    assert Supervisor("eyes", children=[Child(Camera)], process=True, hang=0.5).hang == 0.5
    assert not Child(Camera).process


@pytest.mark.parametrize("hang", [0, -1.0, "5", math.nan, True])
def test_hang_is_a_time(hang: Any) -> None:
    with pytest.raises(DeclarationError, match="hang must be seconds, more than 0"):
        Child(Camera, process=True, hang=hang)


def test_hang_without_a_process_is_refused() -> None:
    with pytest.raises(DeclarationError, match=r"hang=0.1 watches the event loop of a process: add process=True"):
        Child(Camera, hang=0.1)


def test_process_is_a_flag() -> None:
    with pytest.raises(DeclarationError, match="process must be True or False, not 'yes'"):
        Child(Camera, process="yes")  # type: ignore[arg-type]


def test_a_factory_must_be_found_by_its_name() -> None:
    with pytest.raises(
        DeclarationError, match=r"Child\(<lambda>\).*<lambda> cannot be found.*define it at the top level of a module"
    ):
        Child(lambda: Camera(), name="camera", process=True)


@pytest.mark.parametrize("argument", [lambda: 1, open(__file__), Unreadable()], ids=["function", "file", "unreadable"])  # noqa: SIM115
def test_an_argument_that_cannot_be_copied_is_named_with_the_remedy(argument: Any) -> None:
    with pytest.raises(
        DeclarationError, match=r"args\[1\], .*, cannot be copied to another process.*make it in the node"
    ):
        Child(Camera, args=("/dev/video0", argument), process=True)
    with pytest.raises(DeclarationError, match=r"parameters\['mode'\]"):
        Child(Camera, parameters={"mode": argument}, process=True)
    assert Child(Camera, args=(argument,)).args == (argument,)


def test_what_can_be_copied_is_accepted() -> None:
    child = Child(Camera, args=("/dev/video0", {"size": (640, 480)}, Camera, math.inf), process=True)
    assert child.args[2] is Camera


def test_the_nodes_of_a_subtree_are_checked_at_any_depth() -> None:
    odd = Child(Camera, args=(lambda: 1,))
    fine = Child(Camera, name="fine")
    for child in (odd, Supervisor("deep", children=[fine, odd]), DynamicSupervisor("many", odd)):
        with pytest.raises(
            DeclarationError, match=r"Child\(Camera\): Supervisor\('eyes'\) has process=True, and args\[0\]"
        ):
            Supervisor("eyes", children=[fine, child], process=True)
        assert Supervisor("eyes", children=[fine, child]).children == (fine, child)
    assert Supervisor("eyes", children=[fine], process=True).process


def test_what_was_defined_in_an_interactive_session_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    session = ModuleType("__main__")
    exec("from actors import Node\nclass Typed(Node):\n    pass", vars(session))
    monkeypatch.setitem(sys.modules, "__main__", session)
    with pytest.raises(DeclarationError, match="it was defined in an interactive session"):
        Child(session.Typed, process=True)
    session.__file__ = "program.py"
    assert Child(session.Typed, process=True).process


async def test_a_system_without_other_processes_refuses_the_child(rig: Rig) -> None:
    system = create(System, sinks=())
    with pytest.raises(StartFailed, match=r"use run\(tree\)"):
        await system.start(Supervisor("top", Child(Camera, process=True)))


async def test_a_node_beside_the_tree_has_no_process_of_its_own(rig: Rig) -> None:
    await rig.start(Supervisor("tree", children=[Child(Camera)]))
    with pytest.raises(
        DeclarationError,
        match=r"Child\(Camera, name='eye', process=True\): a node beside .* system\.supervisor\.start_child",
    ):
        await rig.system.join(Child(Camera, name="eye", process=True))
    with pytest.raises(DeclarationError, match="drop process=True and host"):
        await rig.system.join(Child(Camera, name="eye", host="base"))
