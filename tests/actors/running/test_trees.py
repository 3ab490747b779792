"""What may be given to be run: `run`, `rig.start` and `blocking.open_node` take the same, and refuse the rest with what to write."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import Child, DeclarationError, DynamicSupervisor, Node, Supervisor, blocking, run
from actors.running.trees import tree_of
from actors.system import system_of
from actors.testing import Rig


class Talker(Node):
    """A node without a word."""


class Listener(Node):
    """Another one."""


def names(system: Any) -> list[str]:
    return sorted(state.identity.fqn for state in system.nodes.values() if state.identity.name != "rig")


@pytest.mark.parametrize(
    ("given", "running"),
    [
        ((Talker,), ["/talker"]),
        ((Child(Talker, name="one"),), ["/one"]),
        (([Talker, Child(Listener)],), ["/listener", "/talker"]),
        (((Talker,),), ["/talker"]),
        ((Talker, Listener), ["/listener", "/talker"]),
        ((Supervisor("half", children=[Child(Talker)]), Listener), ["/listener", "/talker"]),
        (([Supervisor("half", children=[Child(Talker)])],), ["/talker"]),
        ((Supervisor("whole", children=[Child(Talker)]),), ["/talker"]),
    ],
    ids=["class", "child", "list", "tuple", "several", "tree and class", "list of a tree", "tree"],
)
@pytest.mark.virtual
async def test_F2_run_takes_what_rig_start_takes(given: tuple[Any, ...], running: list[str]) -> None:
    async with run(*given) as system:
        assert names(system) == running
    rig = Rig()
    await rig.start(*given)
    assert names(rig.system) == running
    await rig.close()


def test_F2_the_blocking_face_takes_a_class_as_its_tree() -> None:
    with blocking.open_node("script", tree=Talker) as node:
        fqns = node.run(seen)
    assert fqns == ["/script", "/talker"]


async def seen(node: Node) -> list[str]:
    return names(system_of(node))


def test_a_supervisor_is_taken_as_it_is() -> None:
    whole = Supervisor("whole", children=[Child(Talker)])
    empty = DynamicSupervisor("pool", Child(Talker))
    assert tree_of("run(...)", whole) is whole
    assert tree_of("run(...)", empty) is empty
    assert tree_of("run(...)", [whole]) == Supervisor("system", children=[whole])


class Odd:
    """No node."""


def make() -> Node:
    raise AssertionError("nobody calls it")


async def program() -> None:
    raise AssertionError("nobody runs it")


WHAT = "; what runs is a node class, a Child, a Supervisor, or a list of these"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            [Talker()],
            "<Talker, not started> is a node already made: give its class, Talker, which is made anew for every life",
        ),
        ([Odd], "the class Odd is no Node: derive it from Node"),
        ([[Talker, Odd]], "the class Odd is no Node: derive it from Node"),
        ([make], "make is a function: write make() if it returns the tree, Child(make) if it makes the node"),
        (["talker"], "'talker' is str, no part of a tree"),
        ([None], "None is NoneType, no part of a tree"),
        ([Talker, [[Listener]]], "[<class 'tests.actors.running.test_trees.Listener'>] is list, no part of a tree"),
    ],
)
def test_F2_anything_else_is_refused_with_what_to_write(given: list[Any], said: str) -> None:
    with pytest.raises(DeclarationError) as refused:
        run(*given)
    assert str(refused.value) == f"run(...): {said}{WHAT}"


def test_F2_a_coroutine_is_named_and_closed() -> None:
    with pytest.raises(DeclarationError, match=r"program\(\) is a coroutine: .* with execute\(program\)"):
        run(program())  # type: ignore[arg-type]


@pytest.mark.parametrize("given", [[[]], [()], [[], []]])
def test_F2_nothing_at_all_is_refused(given: list[Any]) -> None:
    with pytest.raises(DeclarationError, match=r"^run\(\.\.\.\): there is nothing to run; give it a node class"):
        run(*given)


async def test_F2_each_way_in_names_itself(rig: Rig) -> None:
    with pytest.raises(DeclarationError, match=r"^rig\.start\(\.\.\.\): the class Odd is no Node"):
        await rig.start(Odd)  # type: ignore[arg-type]
    with pytest.raises(DeclarationError, match=r"^blocking\.open_node\('x', tree=\.\.\.\): the class Odd is no Node"):
        await asyncio.to_thread(blocking.open_node, "x", tree=Odd)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("children", "written"), [(Talker, "Child(Talker)"), (Child(Talker), "Child(Talker, name='talker')")]
)
def test_F2_one_child_that_is_not_in_a_list(children: Any, written: str) -> None:
    with pytest.raises(DeclarationError) as refused:
        Supervisor("x", children=children)
    assert str(refused.value) == f"Supervisor('x'): children must be a list, write children=[{written}]"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"name": "größe"},
            "'größe' is not a valid node name: only letters, digits and underscores are allowed (at 2: 'ö')",
        ),
        (
            {"name": "a b"},
            "'a b' is not a valid node name: only letters, digits and underscores are allowed (at 1: ' ')",
        ),
        (
            {"namespace": "/ñ"},
            "'/ñ' is not a valid namespace: only letters, digits and underscores are allowed (at 1: 'ñ')",
        ),
        ({"namespace": 5}, "namespace must be a text such as '/robot1', not 5"),
        (
            {"remap": {"a": "ü"}},
            "'a:=ü' is not a remapping rule: each side must be a name such as scan, /front/scan or ~/scan",
        ),
    ],
)
def test_a_name_that_ros_refuses_is_refused_where_it_is_written(options: dict[str, Any], said: str) -> None:
    with pytest.raises(DeclarationError) as refused:
        Child(Talker, **options)
    assert str(refused.value).startswith(f"Child(Talker): {said}")


def test_names_that_are_good_are_taken() -> None:
    child = Child(Talker, name="ear_1", namespace="robot1/left", remap={"words": "/loud/words"})
    assert (child.name, child.namespace, child.remap) == ("ear_1", "robot1/left", {"words": "/loud/words"})
