"""What people write who come from rclpy is refused with what to write here; other slips get a did-you-mean."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from typing import Any

import pytest

from actors import (
    Child,
    DeclarationError,
    LifecycleNode,
    Node,
    StartFailed,
    Supervisor,
    Topic,
    parameter,
    publishes,
    run,
)
from actors.blocking import BlockingNode
from actors.errors import described
from actors.interfaces.std_msgs.msg import Int32
from actors.runtime.habits import Habits
from actors.testing import Rig
from tests.facts import lacks

OUT = Topic(Int32, "out")


class Pilot(Node):
    """Has a few names of its own."""

    out = publishes(OUT)
    speed = parameter(0.5)

    def __init__(self) -> None:
        self.altitude = 3.0


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("create_wall_timer", "@every(hz=10)"),
        ("create_wall_timer", "self.create_timer(0.1, callback)"),
        ("create_publisher", "cmd = publishes(TOPIC)"),
        ("create_subscription", "@TOPIC.on()"),
        ("create_service", "@SERVICE.serve()"),
        ("create_client", "await self.call(SERVICE, request)"),
        ("create_action_client", "async with self.send_goal(ACTION, goal) as goal"),
        ("create_action_server", "@ACTION.serve()"),
        ("get_logger", "self.log.info("),
        ("declare_parameters", "speed = parameter(0.5)"),
        ("get_parameters", "self.speed"),
        ("set_parameters_atomically", "self.set_parameters({...})"),
        ("add_on_set_parameters_callback", "@speed.validate"),
        ("get_clock", "self.clock"),
        ("destroy_node", "self.stop()"),
        ("spin", "A whole program is spin(Talker), of actors"),
        ("spin_once", "handlers run by themselves"),
        ("executor", "handlers run by themselves"),
        ("get_name", "self.name"),
        ("get_namespace", "self.namespace"),
        ("count_publishers", "graph_of(self)"),
        ("get_topic_names_and_types", "graph_of(self)"),
        ("wait_for_service", "await self.wait_for(SERVICE, timeout=5.0)"),
        ("call_async", "await self.call(SERVICE, request)"),
    ],
)
def test_a_name_of_rclpy_is_refused_with_what_to_write(name: str, written: str) -> None:
    with pytest.raises(AttributeError) as refused:
        getattr(Pilot(), name)
    said = str(refused.value)
    assert said.startswith(f"Pilot has no {name!r}, which is rclpy's: ")
    assert written in said
    assert said.endswith("; see docs/start/from-rclpy.md")


@pytest.mark.parametrize(
    ("owner", "name", "written"),
    [
        (Pilot(), "spawn", "has no 'spawn': a task of the node is made by `self.create_task(work())`"),
        (Pilot(), "start", "has no 'start': a goal is sent by `async with self.send_goal(ACTION, goal) as goal`"),
        (BlockingNode, "start", "has no 'start': a goal is sent by `with node.send_goal(ACTION, goal) as goal`"),
        (Rig, "start_goal", "has no 'start_goal': a goal is sent by `await rig.send_goal(ACTION, goal)`"),
    ],
)
def test_an_old_name_is_refused_with_the_new_one(owner: object, name: str, written: str) -> None:
    with pytest.raises(AttributeError) as refused:
        getattr(owner, name)
    assert str(refused.value).endswith(written)


def test_rclpys_names_are_really_missing_and_not_shown() -> None:
    class Managed(LifecycleNode):
        """A plain one."""

    names = [name for name in vars(Habits) if not name.startswith("_")]
    assert len(names) > 60
    assert [name for name in names if hasattr(Managed(), name) or hasattr(Managed, name)] == []
    assert [name for name in names if name in dir(Managed())] == []
    assert "publisher" in dir(Managed()) and "on_configure" in dir(Managed())


async def test_a_class_may_use_them_for_itself(rig: Rig) -> None:
    class Own(Node):
        executor = None

        async def on_start(self) -> None:
            self.context = self.spin(3)

        def spin(self, turns: int) -> int:
            return 2 * turns

    await rig.start(Own)
    assert rig.node(Own).context == 6


class Slip(Node):
    """Misspells what it has."""

    speed = parameter(1.0)

    async def on_start(self) -> None:
        self.sped  # type: ignore[attr-defined]  # noqa: B018


async def test_F9_a_misspelt_attribute_gets_a_did_you_mean_in_the_report(rig: Rig) -> None:
    with pytest.raises(
        StartFailed, match=r"AttributeError: 'Slip' object has no attribute 'sped'; did you mean 'speed'\?"
    ):
        await rig.start(Slip)


class Unspeakable:
    """Does not even say what it has."""

    def __dir__(self) -> list[str]:
        raise OSError("no memory")


@pytest.mark.parametrize(
    ("owner", "name", "said"),
    [
        (Pilot(), "altitde", "AttributeError: 'Pilot' object has no attribute 'altitde'; did you mean 'altitude'?"),
        (Pilot(), "publishr", "AttributeError: 'Pilot' object has no attribute 'publishr'; did you mean 'publisher'?"),
        (
            Pilot(),
            "__machinry__",
            "AttributeError: 'Pilot' object has no attribute '__machinry__'; did you mean '__machinery__'?",
        ),
        (Pilot(), "xylophone", "AttributeError: 'Pilot' object has no attribute 'xylophone'"),
        (Unspeakable(), "speed", "AttributeError: 'Unspeakable' object has no attribute 'speed'"),
    ],
)
def test_F9_a_misspelt_name_gets_a_did_you_mean(owner: object, name: str, said: str) -> None:
    with pytest.raises(AttributeError) as refused:
        getattr(owner, name)
    assert described(refused.value) == said


def test_F9_an_attribute_error_of_ones_own_is_told_as_it_is() -> None:
    assert described(AttributeError("no such speed")) == "AttributeError: no such speed"


def test_F9_a_forgotten_await_is_named() -> None:
    async def ask() -> int:
        return 1

    asked: Any = ask()
    with pytest.raises(AttributeError) as attribute:
        _ = asked.sum
    with pytest.raises(TypeError) as operand:
        _ = asked[0]
    asked.close()
    assert described(attribute.value).endswith("has no attribute 'sum'; write `await` before the call that made it")
    assert described(operand.value).endswith("is not subscriptable; write `await` before the call that made it")


def test_F9_what_python_itself_looks_for_still_works() -> None:
    @dataclasses.dataclass
    class Record(Node):
        gain: float = 1.0

    pilot = Pilot()
    assert getattr(pilot, "xylophone", 7) == 7
    assert copy.copy(pilot).altitude == copy.deepcopy(pilot).altitude == 3.0
    assert pickle.loads(pickle.dumps(pilot)).altitude == 3.0
    assert dataclasses.replace(Record(gain=2.0), gain=3.0) == Record(gain=3.0)


class Named(Node):
    """As rclpy's documentation writes it."""

    def __init__(self) -> None:
        super().__init__("named")  # type: ignore[call-arg]


@pytest.mark.virtual
async def test_F9_the_name_in_super_init_is_refused_with_where_it_belongs() -> None:
    with pytest.raises(DeclarationError) as refused:
        Named()
    assert lacks(str(refused.value), "Named 'named' Child(Named, name=...) args=(...)") == []
    with pytest.raises(DeclarationError, match=r"^Node: .* not with \(node_name='named'\)"):
        Node(node_name="named")  # type: ignore[call-arg]
    with pytest.raises(StartFailed, match="its name belongs to its place"):
        async with run(Supervisor("x", children=[Child(Named)])):
            raise AssertionError("it has started")


def test_a_mixin_after_the_node_gets_the_arguments() -> None:
    class Mixin:
        def __init__(self, gain: float) -> None:
            self.gain = gain

    class Mixed(Node, Mixin):
        def __init__(self) -> None:
            Node.__init__(self, 2.0)  # type: ignore[call-arg]

    assert Mixed().gain == 2.0


async def test_F9_set_parameters_in_rclpys_form_is_refused(rig: Rig) -> None:
    await rig.start(Pilot)
    with pytest.raises(
        TypeError, match=r"/pilot: set_parameters takes names and values, \{'speed': 1.0\}, not list \["
    ):
        rig.node(Pilot).set_parameters([("speed", 1.0)])  # type: ignore[arg-type]
