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
from actors.interfaces.std_msgs.msg import Int32

OUT = Topic(Int32, "out")


class Pilot(Node):
    """Has a few names of its own."""

    out = publishes(OUT)
    speed = parameter(0.5)

    def __init__(self) -> None:
        self.altitude = 3.0

    @property
    def broken(self) -> float:
        return self.altitude.metres  # type: ignore[attr-defined,no-any-return]


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("create_timer", "@every(hz=10)"),
        ("create_rate", "await self.clock.sleep(0.1)"),
        ("create_publisher", "cmd = publishes(TOPIC)"),
        ("create_subscription", "@TOPIC.on()"),
        ("create_service", "@SERVICE.serve()"),
        ("create_client", "await self.call(SERVICE, request)"),
        ("create_action_client", "async with self.start(ACTION, goal) as goal"),
        ("create_action_server", "@ACTION.serve()"),
        ("get_logger", "self.log.info("),
        ("declare_parameter", "speed = parameter(0.5)"),
        ("declare_parameters", "speed = parameter(0.5)"),
        ("get_parameter", "self.speed"),
        ("set_parameters_atomically", "self.set_parameters({...})"),
        ("add_on_set_parameters_callback", "@speed.validate"),
        ("get_clock", "self.clock"),
        ("destroy_node", "self.stop()"),
        ("spin", "await system.wait()"),
        ("spin_once", "handlers run by themselves"),
        ("executor", "handlers run by themselves"),
        ("get_name", "self.name"),
        ("get_namespace", "self.namespace"),
        ("count_publishers", "publisher_count"),
        ("get_topic_names_and_types", "system.snapshot()"),
        ("wait_for_service", "await self.wait_for(SERVICE, timeout=5.0)"),
        ("call_async", "await self.call(SERVICE, request)"),
    ],
)
def test_E_09_a_name_of_rclpy_is_refused_with_what_to_write(name: str, written: str) -> None:
    with pytest.raises(AttributeError) as refused:
        getattr(Pilot(), name)
    said = str(refused.value)
    assert said.startswith(f"Pilot has no {name!r}, which is rclpy's: ")
    assert written in said
    assert said.endswith("; see docs/coming-from-ros2.md")


def test_E_09_every_rclpy_name_that_is_known_is_really_missing_here() -> None:
    from actors.habits import _REMEDIES  # pyright: ignore[reportPrivateUsage]

    class Managed(LifecycleNode):
        """A plain one."""

    assert len(_REMEDIES) > 60
    assert [name for name in _REMEDIES if hasattr(Managed(), name)] == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("altitde", "Pilot has no attribute 'altitde'; did you mean 'altitude'?"),
        ("sped", "Pilot has no attribute 'sped'; did you mean 'speed'?"),
        ("publishr", "Pilot has no attribute 'publishr'; did you mean 'publisher'?"),
        ("_cor", "Pilot has no attribute '_cor'; did you mean '_core'?"),
        ("xylophone", "Pilot has no attribute 'xylophone'"),
    ],
)
def test_F9_a_misspelt_name_gets_a_did_you_mean(name: str, said: str) -> None:
    with pytest.raises(AttributeError) as refused:
        getattr(Pilot(), name)
    assert str(refused.value) == said
    assert refused.value.name == name


def test_F9_what_python_itself_looks_for_still_works() -> None:
    @dataclasses.dataclass
    class Record(Node):
        gain: float = 1.0

    pilot = Pilot()
    assert not hasattr(pilot, "create_timer")
    assert getattr(pilot, "xylophone", 7) == 7
    assert copy.copy(pilot).altitude == copy.deepcopy(pilot).altitude == 3.0
    assert pickle.loads(pickle.dumps(pilot)).altitude == 3.0
    assert dataclasses.replace(Record(gain=2.0), gain=3.0) == Record(gain=3.0)


def test_F9_an_error_that_a_property_raises_is_not_hidden() -> None:
    with pytest.raises(AttributeError, match="'float' object has no attribute 'metres'"):
        Pilot().broken  # noqa: B018


def test_F9_the_error_can_be_pickled_with_its_words() -> None:
    with pytest.raises(AttributeError) as refused:
        Pilot().altitde  # type: ignore[attr-defined]  # noqa: B018
    again = pickle.loads(pickle.dumps(refused.value))
    assert type(again) is AttributeError
    assert str(again) == "Pilot has no attribute 'altitde'; did you mean 'altitude'?"


class Named(Node):
    """As rclpy's documentation writes it."""

    def __init__(self) -> None:
        super().__init__("named")  # type: ignore[call-arg]


@pytest.mark.virtual
async def test_F9_the_name_in_super_init_is_refused_with_where_it_belongs() -> None:
    with pytest.raises(DeclarationError) as refused:
        Named()
    assert str(refused.value) == (
        "Named: a Node is made without arguments, not with ('named'): its name belongs to its place, Child(Named, name=...), "
        "and what its own __init__ takes comes by Child(Named, args=(...))"
    )
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


async def test_F9_set_parameters_in_rclpys_form_is_refused(rig: Any) -> None:
    await rig.start(Pilot)
    with pytest.raises(
        TypeError, match=r"/pilot: set_parameters takes names and values, \{'speed': 1.0\}, not list \["
    ):
        rig.node(Pilot).set_parameters([("speed", 1.0)])
