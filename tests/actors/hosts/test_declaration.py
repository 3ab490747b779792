"""What may be declared with `host=` and `hosts=`."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable

import pytest

from actors import Child, DeclarationError, DynamicSupervisor, Node, Supervisor, run


class Idle(Node):
    pass


def test_a_child_on_another_machine_has_a_process_of_its_own() -> None:
    child = Child(Idle, host="base")

    assert child.hosts == ("base",)
    assert child.process
    assert child == Child(Idle, hosts=["base"])
    assert pickle.loads(pickle.dumps(child)) == child
    assert repr(child) == "Child(Idle, name='idle', hosts=('base',), process=True)"
    assert Child(Idle, process=True).hosts == ()


def test_a_subtree_may_be_on_one_of_several_machines() -> None:
    tree = Supervisor("arm", hosts=["base", "spare"], children=[Child(Idle, process=True)])

    assert tree.hosts == ("base", "spare")
    assert tree.replace(process=False, hosts=()).process is False


def test_instances_of_a_template_are_where_it_is() -> None:
    spawner = DynamicSupervisor("idles", Child(Idle, host="base"))

    assert spawner.instance("first").hosts == ("base",)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (
            lambda: Child(Idle, host="base", hosts=["spare"]),
            "host='base' is short for hosts=['base']: give one of the two",
        ),
        (lambda: Child(Idle, hosts="base"), "hosts must be a list or a tuple, not 'base'"),
        (lambda: Child(Idle, hosts=["base", "base"]), "names a host twice"),
        (lambda: Child(Idle, host=""), "a host must be the name of a machine, not ''"),
        (lambda: Child(Idle, hosts=[3]), "a host must be the name of a machine, not 3"),  # type: ignore[list-item]
        (lambda: Child(lambda: Idle(), name="idle", host="base"), "it is to run on base, and its factory"),
        (
            lambda: Supervisor("arm", hosts=["base", "spare"], children=[Child(Idle, args=(sys.stdout,))]),
            "it is to run on base or spare, and args[0]",
        ),
        (
            lambda: Supervisor("arm", process=True, children=[Child(Idle, host="base")]),
            "only the process in which a tree is run gives parts of it to other machines: move this child up",
        ),
        (
            lambda: Supervisor("arm", host="a", children=[Supervisor("hand", children=[Child(Idle, host="b")])]),
            "only the process in which a tree is run gives parts of it",
        ),
        (
            lambda: Supervisor("arm", host="a", children=[DynamicSupervisor("idles", Child(Idle, host="b"))]),
            "only the process in which a tree is run gives parts of it",
        ),
        (lambda: run(Child(Idle, host="base"), hosts=object()), "nodes on other machines are reached by a transport"),  # type: ignore[arg-type]
    ],
)
def test_what_cannot_be_meant_is_refused_with_the_remedy(make: Callable[[], object], text: str) -> None:
    with pytest.raises(DeclarationError) as refused:
        make()

    assert text in str(refused.value)


def test_another_machine_does_not_have_the_script_that_this_program_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Idle, "__module__", "__main__")
    monkeypatch.setattr(sys.modules["__main__"], "Idle", Idle, raising=False)
    monkeypatch.setattr(sys.modules["__main__"], "__file__", "script.py", raising=False)

    with pytest.raises(DeclarationError, match="another machine does not have this script; define it at the top level"):
        Child(Idle, host="base")
    assert Child(Idle, process=True).process
