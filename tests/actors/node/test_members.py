"""Names of a node class that would hide the framework's, a handler, or a hook: refused when the class is made, or when the node starts."""

from __future__ import annotations

import functools
import re
from collections.abc import Coroutine
from typing import Any

import pytest

from actors import DeclarationError, LifecycleNode, Node, StartFailed, Topic, every, parameter, publishes, subscribes
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32
from actors.lifecycle import LifecycleState
from actors.testing import Rig
from tests.stage import ADD, NUMBERS


def refused(text: str) -> Any:
    return pytest.raises(DeclarationError, match="^" + re.escape(text))


def make(name: str, value: object, base: type = Node) -> type:
    return type("Pilot", (base,), {name: value})


# -- the framework's own names ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value", "base", "said"),
    [
        ("log", publishes(NUMBERS), Node, "Pilot.log would take the place of Node.log"),
        (
            "stop",
            lambda self: None,
            Node,
            "Pilot.stop would take the place of Node.stop (\"Ask for this node's own orderly end.",
        ),
        (
            "create_task",
            every(hz=1)(lambda self: None),
            Node,
            "Pilot.create_task would take the place of Node.create_task",
        ),
        ("clock", 5, Node, "Pilot.clock would take the place of Node.clock"),
        ("name", parameter("x"), Node, "Pilot.name would take the place of Node.name"),
        ("state", publishes(NUMBERS), LifecycleNode, "Pilot.state would take the place of LifecycleNode.state"),
        ("call", None, LifecycleNode, "Pilot.call would take the place of Node.call"),
        (
            "__begin__",
            lambda self: None,
            Node,
            "Pilot.__begin__ would take the place of Node.__begin__, which is the framework's own",
        ),
        (
            "on_start",
            every(hz=1)(lambda self: None),
            Node,
            "Pilot.on_start is a hook of the framework: @every(hz=1) needs",
        ),
    ],
)
def test_C5_a_name_of_the_framework_is_refused(name: str, value: object, base: type, said: str) -> None:
    with refused(said):
        make(name, value, base)


def test_C5_a_handler_named_stop_is_refused() -> None:
    with refused("Pilot.stop would take the place of Node.stop"):

        class Pilot(Node):
            @NUMBERS.on()
            async def stop(self, message: Int32) -> None: ...  # type: ignore[override]


def test_C5_a_mixin_before_the_node_hides_as_well_and_one_after_it_does_not() -> None:
    class Mixin:
        def stop(self) -> None: ...

    with refused("Pilot.stop would take the place of Node.stop"):
        type("Pilot", (Mixin, Node), {})
    assert issubclass(type("Pilot", (Node, Mixin), {}), Node)


def test_C5_what_extends_the_framework_by_super_means_to() -> None:
    class Polite(Node):
        node_name = "polite"

        def stop(self, reason: str = "thank you") -> None:
            super().stop(reason)

    class Managed(LifecycleNode):
        autostart = "active"

        async def on_configure(self, previous: LifecycleState) -> None: ...

    assert Polite.node_name == "polite"
    assert Managed.autostart == "active"


class Hiding(Node):
    """Forgets that `on` is a method."""

    async def on_start(self) -> None:
        self.on = False  # type: ignore[assignment,method-assign]


class HidingInInit(Node):
    """Forgets it still earlier."""

    def __init__(self) -> None:
        self.send_goal = 1.0  # type: ignore[assignment,method-assign]


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (Hiding, 'Hiding: self.on = False hides the method Node.on ("Let `handler` take the topic'),
        (HidingInInit, 'HidingInInit: self.send_goal = 1.0 hides the method Node.send_goal ("A goal'),
    ],
)
async def test_C5_an_attribute_of_the_instance_that_hides_a_method_is_refused(
    rig: Rig, kind: type[Node], said: str
) -> None:
    with pytest.raises(StartFailed, match=re.escape(said)):
        await rig.start(kind)


# -- hooks -----------------------------------------------------------------------------------------------------------------------


async def alone(self: Any) -> None: ...


async def with_reason(self: Any, reason: Any) -> None: ...


def plain(self: Any) -> None: ...


def with_state(self: Any, state: Any) -> None: ...


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("on_strat", alone, "Pilot.on_strat is never called; did you mean `async def on_start(self)`?"),
        ("onstart", alone, "Pilot.onstart is never called; did you mean `async def on_start(self)`?"),
        ("on_stpo", with_reason, "Pilot.on_stpo is never called; did you mean `async def on_stop(self, reason)`?"),
        ("handovr", plain, "Pilot.handovr is never called; did you mean `def handover(self)`?"),
        ("resum", with_state, "Pilot.resum is never called; did you mean `def resume(self, state)`?"),
        ("on_activate", with_reason, "Pilot.on_activate is a hook of LifecycleNode, and Pilot is none: derive it from"),
        ("on_shutdown", with_reason, "Pilot.on_shutdown is a hook of LifecycleNode, and Pilot is none: derive it from "
         "LifecycleNode, write on_stop, or choose another name"),
    ],
)  # fmt: skip
def test_C5_a_misspelt_hook_is_refused_with_what_is_meant(name: str, value: object, said: str) -> None:
    with refused(said):
        make(name, value)


def test_C5_a_misspelt_hook_of_a_lifecycle_node() -> None:
    with refused("Pilot.on_configur is never called; did you mean `async def on_configure(self, previous)`?"):
        make("on_configur", with_reason, LifecycleNode)


def test_a_hook_is_something_to_call() -> None:
    with refused("Pilot.on_start: write it as `async def on_start(self)`"):
        make("on_start", 5)
    assert hasattr(make("on_start", functools.partial(alone, None)), "on_start")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("on_goal", with_reason),
        ("on_strat", plain),  # not what on_start is
        ("on_scan", alone),
        ("resumes", 5),
        ("handed_over", plain),
    ],
)
def test_C5_methods_of_ones_own_are_fine(name: str, value: object) -> None:
    assert hasattr(make(name, value), name)


def test_C5_a_method_that_the_class_itself_uses_is_its_own() -> None:
    class Stepper(Node):
        async def on_start(self) -> None:
            self.on(NUMBERS, self.on_step)
            self.create_task(self.on_started())

        async def on_step(self, message: Int32) -> None: ...

        async def on_started(self) -> None:
            def later() -> None:
                self.on_cleanup()

            later()

        def on_cleanup(self) -> None: ...

    class Further(Stepper):
        async def on_step(self, message: Int32) -> None: ...

    assert issubclass(Further, Stepper)


# -- overriding what is declared -----------------------------------------------------------------------------------------------


class Base(Node):
    """Declares one of each."""

    out = publishes(NUMBERS)
    words = subscribes(NUMBERS)
    speed = parameter(1.0)

    @NUMBERS.on()
    async def take(self, message: Int32) -> None: ...

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    @every(hz=1)
    def tick(self) -> None: ...


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("take", with_reason, "Pilot.take overrides Base.take, which is @Topic(Int32, 'numbers').on(), and would not be so any "
         "more: repeat the decorator above it, choose another name, or write `take = None` to do without it"),
        ("add", with_reason, "Pilot.add overrides Base.add, which is @Service(AddTwoInts, 'add').serve()"),
        ("tick", plain, "Pilot.tick overrides Base.tick, which is @every(hz=1)"),
        ("speed", 2.0, "Pilot.speed overrides Base.speed, which is <parameter 'speed': DOUBLE = 1.0>, and would not be so any "
         "more: declare it again"),
        ("out", plain, "Pilot.out overrides Base.out, which is publishes(Topic(Int32, 'numbers'))"),
        ("words", 5, "Pilot.words overrides Base.words, which is subscribes(Topic(Int32, 'numbers'))"),
    ],
)  # fmt: skip
def test_overriding_a_declaration_without_one_is_refused(name: str, value: object, said: str) -> None:
    with refused(said):
        make(name, value, Base)


def test_a_declaration_is_overridden_by_another_or_given_up_in_so_many_words() -> None:
    class Derived(Base):
        out = publishes(Topic(Int32, "other"))
        speed = parameter(2.0)
        tick = None  # type: ignore[assignment]

        @NUMBERS.on(qos=1)
        async def take(self, message: Int32) -> None: ...

    declarations = Derived.declarations
    assert [each.topic.name for each in declarations.publishers] == ["other"]
    assert declarations.timers == []
    assert [each.qos.depth for each in declarations.topics] == [1]


@pytest.mark.parametrize(
    ("wrapper", "kind"),
    [
        (staticmethod, "staticmethod"),
        (classmethod, "classmethod"),
        (property, "property"),
        (functools.cached_property, "cached_property"),
        (functools.partialmethod, "partialmethod"),
    ],
)
def test_a_decorator_of_pythons_above_ours_is_refused(wrapper: Any, kind: str) -> None:
    with refused(f"Pilot.x is @every(hz=10) and a {kind}: make it a plain method, without {kind}"):
        make("x", wrapper(every(hz=10)(lambda self: None)))
    assert hasattr(make("x", wrapper(plain)), "x")


# -- handlers given at run time --------------------------------------------------------------------------------------------------


class Answers:
    """An object that answers."""

    async def __call__(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=1)


async def answer(request: AddTwoInts.Request) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=2)


def annotated(request: AddTwoInts.Request) -> Coroutine[Any, Any, AddTwoInts.Response]:
    return answer(request)


def at_once(request: AddTwoInts.Request) -> AddTwoInts.Response:
    raise AssertionError("never called")


@functools.wraps(answer)
def wrapped(request: AddTwoInts.Request) -> Any:
    return answer(request)


@pytest.mark.parametrize(
    "handler", [answer, Answers(), functools.partial(functools.partial(answer)), wrapped, annotated]
)
async def test_what_answers_asynchronously_may_serve(rig: Rig, handler: Any) -> None:
    await rig.start(Node)
    rig.me.serve(ADD, handler)
    assert (await rig.call(ADD, AddTwoInts.Request())).sum in (1, 2)


@pytest.mark.parametrize("handler", [at_once, lambda request: AddTwoInts.Response(), None, int, 5])
async def test_a_plain_function_cannot_serve(rig: Rig, handler: Any) -> None:
    await rig.start(Node)
    with pytest.raises(
        DeclarationError, match=r"^/rig\.serve\(Service\(.*the handler answers by `await`; make it `async def`"
    ):
        rig.me.serve(ADD, handler)


async def test_a_handler_must_be_callable(rig: Rig) -> None:
    await rig.start(Node)
    with refused("/rig.on(Topic(Int32, 'numbers'), None): the handler must be a function or a method"):
        rig.me.on(NUMBERS, None)  # type: ignore[arg-type]
