"""What a node class declares is checked when the class is made, and the error says where and what to do."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

from actors import (
    DeclarationError,
    Done,
    Node,
    Steps,
    Tick,
    Topic,
    background,
    every,
    parameter,
    publishes,
    qos,
    subscribes,
)
from actors.blueprint import Blueprint
from actors.contracts import Declaration
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String
from tests.stage import ADD, COUNT, NUMBERS, WORDS, result

if TYPE_CHECKING:
    from actors.interfaces.std_msgs.msg import Bool


def logged(method: Callable[..., Any]) -> Callable[..., Any]:
    """A decorator such as users write."""

    @functools.wraps(method)
    def wrapper(*args: Any, **keywords: Any) -> Any:
        return method(*args, **keywords)

    return wrapper


class Everything(Node):
    """Declares one of each."""

    out = publishes(NUMBERS)
    latched = publishes(WORDS, qos=qos.LATCHED)
    words = subscribes(WORDS)
    numbers = subscribes(NUMBERS, qos=3)
    speed = parameter(0.5)
    rate = parameter(10.0)

    @NUMBERS.on()
    async def take(self, message: Int32) -> None: ...

    @WORDS.on()
    def read(self, message: String) -> None: ...

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response()

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(result())

    @COUNT.accepts
    async def check(self, goal: Fibonacci.Goal) -> None: ...

    @COUNT.cancels
    def may_cancel(self, goal: Fibonacci.Goal) -> bool:
        return True

    @every(hz=50)
    async def tick(self) -> None: ...

    @every(period=0.2, late="catch_up")
    def slow_tick(self, tick: Tick) -> None: ...

    @every("rate")
    def steady(self) -> None: ...

    @background
    async def drive(self) -> None: ...


def test_a_blueprint_lists_what_the_class_declares_in_order() -> None:
    blueprint = Everything.blueprint
    assert blueprint.owner is Everything
    assert [(each.attribute, each.topic, each.qos.depth) for each in blueprint.publishers] == [
        ("out", NUMBERS, 100), ("latched", WORDS, 1),
    ]  # fmt: skip
    assert [(each.attribute, each.topic, each.qos.depth) for each in blueprint.streams] == [
        ("words", WORDS, 10), ("numbers", NUMBERS, 3),
    ]  # fmt: skip
    assert [each.attribute for each in blueprint.topics] == ["take", "read"]
    assert [each.attribute for each in blueprint.services] == ["add"]
    assert [each.attribute for each in blueprint.actions] == ["count"]
    assert [(each.attribute, each.verb) for each in blueprint.hooks] == [
        ("check", "accepts"),
        ("may_cancel", "cancels"),
    ]
    assert [(each.attribute, each.hz, each.late) for each in blueprint.timers] == [
        ("tick", 50, "skip"), ("slow_tick", 5.0, "catch_up"), ("steady", "rate", "skip"),
    ]  # fmt: skip
    assert [each.attribute for each in blueprint.backgrounds] == ["drive"]
    assert [each.name for each in blueprint.parameters] == ["speed", "rate"]


def test_declarations_read_as_they_are_written() -> None:
    blueprint = Everything.blueprint
    assert repr(blueprint.publishers[0]) == "publishes(Topic(Int32, 'numbers'))"
    assert repr(blueprint.streams[0]) == "subscribes(Topic(String, 'words'))"
    assert repr(blueprint.timers[0]) == "@every(hz=50)"
    assert repr(blueprint.backgrounds[0]) == "@background"


def test_on_the_class_a_declared_endpoint_is_its_contract() -> None:
    assert Everything.out is NUMBERS
    assert Everything.words is WORDS


def test_a_subclass_inherits_and_a_redefinition_takes_the_place_of_what_it_overrides() -> None:
    other = Topic(Int32, "other")

    class Derived(Everything):
        out = publishes(other)

        @NUMBERS.on(qos=1)
        async def take(self, message: Int32) -> None: ...

        def read(self, message: String) -> None: ...

    blueprint = Derived.blueprint
    assert [each.topic for each in blueprint.publishers] == [other, WORDS]
    assert [(each.attribute, each.qos.depth) for each in blueprint.topics] == [("take", 1)]
    assert [each.attribute for each in blueprint.timers] == ["tick", "slow_tick", "steady"]
    assert Everything.blueprint.topics[0].qos.depth == 100


def test_a_method_may_wear_decorators_of_the_users_own() -> None:
    class Decorated(Node):
        @NUMBERS.on()
        @logged
        async def take(self, message: Int32) -> None: ...

        @every(hz=1)
        @logged
        def tick(self, tick: Tick) -> None: ...

    assert [each.attribute for each in Decorated.blueprint.topics] == ["take"]
    with pytest.raises(DeclarationError, match="but takes String"):

        class Wrong(Node):
            @NUMBERS.on()
            @logged
            async def take(self, message: String) -> None: ...


def test_annotations_that_cannot_be_read_or_say_nothing_are_left_to_the_type_checker() -> None:
    class Lenient(Node):
        @NUMBERS.on()
        async def bare(self, message) -> None: ...  # type: ignore[no-untyped-def]

        @NUMBERS.on()  # type: ignore[arg-type]
        async def hidden(self, message: Bool) -> None: ...

        @NUMBERS.on()
        async def any(self, message: Any) -> None: ...

        @NUMBERS.on()
        async def object(self, message: object) -> None: ...

        @NUMBERS.on()
        async def union(self, message: Int32 | None) -> None: ...

    assert len(Lenient.blueprint.topics) == 5


def refused(sentence: str) -> Any:
    return pytest.raises(DeclarationError, match=re.escape(sentence))


def test_a_handler_that_takes_another_message_than_its_contract_is_refused() -> None:
    with refused(
        "Navigator.guard listens to Topic(Int32, 'numbers') (Int32) but takes String: change the annotation or the contract"
    ):

        class Navigator(Node):
            @NUMBERS.on()  # type: ignore[arg-type]
            async def guard(self, message: String) -> None: ...

    with refused("Server.add serves Service(AddTwoInts, 'add') (AddTwoInts_Request) but takes AddTwoInts_Response"):

        class Server(Node):
            @ADD.serve()  # type: ignore[arg-type]
            async def add(self, request: AddTwoInts.Response) -> AddTwoInts.Response:
                return request

    with refused("Mover.check is @accepts of Action(Fibonacci, 'count') (Fibonacci_Goal) but takes Fibonacci_Result"):

        class Mover(Node):
            @COUNT.serve()
            async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
                yield Done(result())

            @COUNT.accepts  # type: ignore[arg-type]
            def check(self, goal: Fibonacci.Result) -> None: ...


def test_a_handler_with_the_wrong_number_of_arguments_is_refused() -> None:
    with refused("Wrong.take listens to Topic(Int32, 'numbers'): it must take self and one Int32"):

        class Wrong(Node):
            @NUMBERS.on()  # type: ignore[arg-type]
            async def take(self) -> None: ...

    with refused("Timed.tick is @every(hz=1): it must take self, and a Tick if it wants one"):

        class Timed(Node):
            @every(hz=1)
            async def tick(self, tick: Tick, more: int) -> None: ...

    with refused("Driver.drive is @background: make it `async def drive(self)`"):

        class Driver(Node):
            @background  # type: ignore[arg-type]
            async def drive(self, extra: int) -> None: ...


def test_a_method_of_the_wrong_kind_is_refused() -> None:
    with refused("Server.add serves Service(AddTwoInts, 'add'): make it `async def`"):

        class Server(Node):
            @ADD.serve()  # type: ignore[arg-type]
            def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
                return AddTwoInts.Response()

    with refused("Mover.count serves Action(Fibonacci, 'count'): make it an async generator, one that yields feedback"):

        class Mover(Node):
            @COUNT.serve()  # type: ignore[arg-type]
            async def count(self, goal: Fibonacci.Goal) -> Fibonacci.Result:
                return result()

    with refused("Driver.drive is @background: make it `async def drive(self)`"):

        class Driver(Node):
            @background  # type: ignore[arg-type]
            def drive(self) -> None: ...


def test_one_contract_has_one_server_in_a_class_and_each_hook_one_method() -> None:
    with refused("Twice.second and .first both serve Service(AddTwoInts, 'add'): keep one"):

        class Twice(Node):
            @ADD.serve()
            async def first(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
                return AddTwoInts.Response()

            @ADD.serve()
            async def second(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
                return AddTwoInts.Response()

    with refused("Hooked.two and .one both are @accepts of Action(Fibonacci, 'count'): keep one"):

        class Hooked(Everything):
            @COUNT.accepts
            def one(self, goal: Fibonacci.Goal) -> None: ...

            @COUNT.accepts
            def two(self, goal: Fibonacci.Goal) -> None: ...

            check = None  # type: ignore[assignment]


def test_a_hook_needs_its_action_and_a_named_rate_its_parameter() -> None:
    with refused(
        "Lonely.check: @Action(Fibonacci, 'count').accepts without a method that is @Action(Fibonacci, 'count').serve()"
    ):

        class Lonely(Node):
            @COUNT.accepts
            def check(self, goal: Fibonacci.Goal) -> None: ...

    with refused("Clockwork.tick: @every(hz='rate') names a parameter that the class does not declare"):

        class Clockwork(Node):
            @every(hz="rate")
            async def tick(self) -> None: ...


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({}, "every(): give either hz=, ticks per second, or period=, seconds"),
        ({"hz": 1.0, "period": 1.0}, "every(): give either hz=, ticks per second, or period=, seconds"),
        ({"hz": 0}, "every(hz=0, period=None): the rate must be above 0 and below a million per second"),
        ({"hz": float("nan")}, "the rate must be above 0"),
        ({"period": 0.0}, "every(hz=None, period=0.0): the rate must be above 0"),
        ({"period": -1.0}, "the rate must be above 0"),
        ({"hz": 2e6}, "below a million per second"),
        ({"hz": 1.0, "late": "never"}, "every(late='never'): use skip, catch_up or fault"),
    ],
)
def test_a_rate_that_is_none_is_refused(options: dict[str, Any], sentence: str) -> None:
    with refused(sentence):
        every(**options)


def test_a_hook_of_the_wrong_kind_is_refused_before_anything_runs() -> None:
    with refused("Hasty.on_start: write it as `async def on_start(self)`"):

        class Hasty(Node):
            def on_start(self) -> None: ...  # type: ignore[override]

    with refused("Deaf.on_stop: write it as `async def on_stop(self, reason)`"):

        class Deaf(Node):
            async def on_stop(self) -> None: ...  # type: ignore[override]

    with refused("Dreamer.on_error: write it as `def on_error(self, error, handler)`"):

        class Dreamer(Node):
            async def on_error(self, error: Exception, handler: str) -> None: ...  # type: ignore[override]

    class Fine(Node):
        @logged
        async def on_start(self) -> None: ...

        async def on_stop(self, *reason: Any) -> None: ...

    assert Fine.blueprint.owner is Fine


def test_a_declaration_that_nobody_knows_is_refused() -> None:
    class Odd(Declaration):
        def __repr__(self) -> str:
            return "@odd"

    def method(self: Any) -> None: ...

    Odd().attach(method)
    with refused("Host.method: unknown declaration @odd"):
        Blueprint(type("Host", (), {"method": method}))
