"""What a node class declares is checked when the class is made, and the error says where and what to do."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Annotated, Any, Protocol

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
from actors.contracts.contracts import Declaration
from actors.interfaces import Message
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String
from actors.runtime.declarations import Declarations
from tests.stage import ADD, COUNT, NUMBERS, WORDS, result

if TYPE_CHECKING:
    from actors.interfaces.std_msgs.msg import Bool


class Shape(Protocol):
    """What a handler may ask of a message without naming its class; it cannot be looked at while the program runs."""

    @property
    def data(self) -> int: ...


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

    @every(hz="rate")
    def steady(self) -> None: ...

    @background
    async def drive(self) -> None: ...


def test_a_blueprint_lists_what_the_class_declares_in_order() -> None:
    declarations = Everything.declarations
    assert declarations.owner is Everything
    assert [(each.attribute, each.topic, each.qos.depth) for each in declarations.publishers] == [
        ("out", NUMBERS, 100), ("latched", WORDS, 1),
    ]  # fmt: skip
    assert [(each.attribute, each.topic, each.qos.depth) for each in declarations.streams] == [
        ("words", WORDS, 10), ("numbers", NUMBERS, 3),
    ]  # fmt: skip
    assert [each.attribute for each in declarations.topics] == ["take", "read"]
    assert [each.attribute for each in declarations.services] == ["add"]
    assert [each.attribute for each in declarations.actions] == ["count"]
    assert [(each.attribute, each.verb) for each in declarations.hooks] == [
        ("check", "accepts"),
        ("may_cancel", "cancels"),
    ]
    assert [(each.attribute, each.hz, each.late) for each in declarations.timers] == [
        ("tick", 50, "skip"), ("slow_tick", 5.0, "catch_up"), ("steady", "rate", "skip"),
    ]  # fmt: skip
    assert [each.attribute for each in declarations.backgrounds] == ["drive"]
    assert [each.name for each in declarations.parameters] == ["speed", "rate"]


def test_declarations_read_as_they_are_written() -> None:
    declarations = Everything.declarations
    assert repr(declarations.publishers[0]) == "publishes(Topic(Int32, 'numbers'))"
    assert repr(declarations.streams[0]) == "subscribes(Topic(String, 'words'))"
    assert repr(declarations.timers[0]) == "@every(hz=50)"
    assert repr(declarations.backgrounds[0]) == "@background"


def test_on_the_class_a_declared_endpoint_is_its_contract() -> None:
    assert Everything.out is NUMBERS
    assert Everything.words is WORDS


def test_a_subclass_inherits_and_a_redefinition_takes_the_place_of_what_it_overrides() -> None:
    other = Topic(Int32, "other")

    class Derived(Everything):
        out = publishes(other)

        @NUMBERS.on(qos=1)
        async def take(self, message: Int32) -> None: ...

        read = None  # type: ignore[assignment]

    declarations = Derived.declarations
    assert [each.topic for each in declarations.publishers] == [other, WORDS]
    assert [(each.attribute, each.qos.depth) for each in declarations.topics] == [("take", 1)]
    assert [each.attribute for each in declarations.timers] == ["tick", "slow_tick", "steady"]
    assert Everything.declarations.topics[0].qos.depth == 100


def test_a_method_may_wear_decorators_of_the_users_own() -> None:
    class Decorated(Node):
        @NUMBERS.on()
        @logged
        async def take(self, message: Int32) -> None: ...

        @every(hz=1)
        @logged
        def tick(self, tick: Tick) -> None: ...

    assert [each.attribute for each in Decorated.declarations.topics] == ["take"]
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

        @NUMBERS.on()
        async def noted(self, message: Annotated[Int32, "metres"]) -> None: ...

        @NUMBERS.on()
        async def shaped(self, message: Shape) -> None: ...

    class Vague(Node):
        @COUNT.serve()  # type: ignore[arg-type]
        async def count(self, goal: Fibonacci.Goal) -> object:
            yield Done(result())

    class Untyped(Node):
        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Any:
            yield Done(result())

    assert len(Lenient.declarations.topics) == 7
    assert len(Vague.declarations.actions) == 1


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


def test_a_service_handler_that_returns_another_message_than_its_contract_is_refused() -> None:
    with refused(
        "Server.add serves Service(AddTwoInts, 'add') but returns AddTwoInts_Request: it must return AddTwoInts_Response; change"
    ):

        class Server(Node):
            @ADD.serve()  # type: ignore[arg-type]
            async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Request:
                return request

    with refused("Silent.add serves Service(AddTwoInts, 'add') but returns None: it must return AddTwoInts_Response"):

        class Silent(Node):
            @ADD.serve()  # type: ignore[arg-type]
            async def add(self, request: AddTwoInts.Request) -> None: ...

    with refused("Hasty.add serves Service(AddTwoInts, 'add') but returns int | None"):

        class Hasty(Node):
            @ADD.serve()  # type: ignore[arg-type]
            async def add(self, request: AddTwoInts.Request) -> int | None: ...


def test_a_topic_handler_that_returns_something_is_refused() -> None:
    with refused("Echo.take listens to Topic(Int32, 'numbers') but returns Int32: nobody takes that"):

        class Echo(Node):
            @NUMBERS.on()  # type: ignore[type-var]
            async def take(self, message: Int32) -> Int32:
                return message

    with refused("Sync.take listens to Topic(Int32, 'numbers') but returns int"):

        class Sync(Node):
            @NUMBERS.on()  # type: ignore[type-var]
            def take(self, message: Int32) -> int:
                return 1

    class Fine(Node):
        @NUMBERS.on()
        def take(self, message: Int32) -> Coroutine[Any, Any, None]:
            return self.later()

        async def later(self) -> None: ...

    assert len(Fine.declarations.topics) == 1


def test_an_action_body_that_yields_or_ends_with_another_message_than_its_contract_is_refused() -> None:
    with refused(
        "Swapped.count serves Action(Fibonacci, 'count') but says it will yield Fibonacci_Result as feedback: "
    ):

        class Swapped(Node):
            @COUNT.serve()  # type: ignore[arg-type]
            async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Result, Fibonacci.Result]:
                yield Done(result())

    with refused("but says it will end with actors.contracts.contracts.Done[") as caught:

        class Ended(Node):
            @COUNT.serve()  # type: ignore[arg-type]
            async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Goal]:
                yield Done(goal)

    assert str(caught.value).endswith("annotate it `-> Steps[Fibonacci_Feedback, Fibonacci_Result]`")
    with refused(
        "Returning.count serves Action(Fibonacci, 'count') but says it returns Fibonacci_Result: it is an async"
    ):

        class Returning(Node):
            @COUNT.serve()  # type: ignore[arg-type]
            async def count(self, goal: Fibonacci.Goal) -> Fibonacci.Result:  # type: ignore[misc]
                yield Done(result())


def test_a_parameter_annotation_is_refused_only_when_it_contradicts() -> None:
    with refused("Lists.take listens to Topic(Int32, 'numbers') (Int32) but takes list[actors.interfaces"):

        class Lists(Node):
            @NUMBERS.on()  # type: ignore[arg-type]
            async def take(self, message: list[Int32]) -> None: ...

    with refused("Noted.take listens to Topic(Int32, 'numbers') (Int32) but takes "):

        class Noted(Node):
            @NUMBERS.on()  # type: ignore[arg-type]
            async def take(self, message: Annotated[String, "metres"]) -> None: ...

    with refused("Unions.take listens to Topic(Int32, 'numbers') (Int32) but takes "):

        class Unions(Node):
            @NUMBERS.on()  # type: ignore[arg-type]
            async def take(self, message: String | None) -> None: ...

    class Generous(Node):
        @NUMBERS.on()
        async def take(self, message: Message) -> None: ...

        @ADD.serve()  # type: ignore[arg-type]
        async def add(self, request: AddTwoInts.Request | None) -> Message:
            return AddTwoInts.Response()

    assert Generous.declarations.owner is Generous


def test_behind_a_decorator_of_the_users_own_the_return_annotation_says_nothing() -> None:
    def answers(method: Callable[..., Any]) -> Any:
        @functools.wraps(method)
        async def wrapper(self: Any, request: Any) -> AddTwoInts.Response:
            return AddTwoInts.Response(sum=await method(self, request))

        return wrapper

    class Short(Node):
        @ADD.serve()
        @answers
        async def add(self, request: AddTwoInts.Request) -> int:
            return request.a + request.b

    assert len(Short.declarations.services) == 1


def test_a_decorator_without_its_parentheses_says_how_to_write_it() -> None:
    with refused("@Topic(Int32, 'numbers').on without parentheses: write @Topic(Int32, 'numbers').on() above `take`"):

        class Listener(Node):
            @NUMBERS.on  # type: ignore[arg-type]
            async def take(self, message: Int32) -> None: ...  # type: ignore[misc]

    with refused("@Service(AddTwoInts, 'add').serve without parentheses: write"):

        class Server(Node):
            @ADD.serve  # type: ignore[arg-type]
            async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response: ...  # type: ignore[misc, empty-body]

    with refused("@Action(Fibonacci, 'count').serve without parentheses: write"):

        class Mover(Node):
            @COUNT.serve  # type: ignore[arg-type]
            async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:  # type: ignore[misc]
                yield Done(result())

    with refused("@every without its rate: write @every(hz=10) or @every(period=0.1) above `tick`"):

        class Timed(Node):
            @every  # type: ignore[arg-type]
            async def tick(self) -> None: ...  # type: ignore[misc]

    with refused("@Topic(Int32, 'numbers').on(5): its options are given by name"):
        NUMBERS.on(5)  # type: ignore[arg-type]


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
    ("value", "sentence"),
    [
        (10, "every(10): write every(hz=10), ticks per second, or every(period=10), seconds"),
        ("rate", "every('rate'): write every(hz='rate')"),
    ],
)
def test_a_rate_or_a_period_is_named_as_that(value: Any, sentence: str) -> None:
    """`create_timer(10)` of rclpy is every 10 s, and 10 Hz is what others mean."""
    with refused(sentence):
        every(value)


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

    assert Fine.declarations.owner is Fine


def test_a_declaration_that_nobody_knows_is_refused() -> None:
    class Odd(Declaration):
        def __repr__(self) -> str:
            return "@odd"

    def method(self: Any) -> None: ...

    Odd().attach(method)
    with refused("Host.method: unknown declaration @odd"):
        Declarations(type("Host", (), {"method": method}))


@pytest.mark.parametrize("declare", [publishes, subscribes])
def test_a_name_in_the_place_of_a_contract_is_refused(declare: Any) -> None:
    with pytest.raises(DeclarationError, match=r"es\('chatter'\): give a contract, such as CHATTER = "):
        declare("chatter")
