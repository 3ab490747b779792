"""Contracts: typed names, checked when they are made."""

from __future__ import annotations

from typing import Any

import pytest

from actors import Aborted, Action, DeclarationError, Done, Service, Topic, qos
from actors.actions import parallel, queue
from actors.contracts.contracts import ActionHandler, GoalHook, ServiceHandler, TopicHandler, declarations_of
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String
from tests.stage import ADD, COUNT, NUMBERS, WORDS


async def handler(self: Any, message: Any) -> None: ...


def test_a_topic_has_a_type_a_name_and_a_quality_of_service() -> None:
    assert (WORDS.type, WORDS.name, WORDS.qos) == (String, "words", qos.DEFAULT)
    assert Topic(String, "/abs/words", 5).qos.depth == 5
    assert Topic(String, "words", qos.LATCHED).qos is qos.LATCHED
    assert repr(NUMBERS) == "Topic(Int32, 'numbers')"


def test_a_service_and_an_action_know_their_parts() -> None:
    assert (ADD.request, ADD.response) == (AddTwoInts.Request, AddTwoInts.Response)
    assert (COUNT.goal, COUNT.result, COUNT.feedback) == (Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback)
    assert (repr(ADD), repr(COUNT)) == ("Service(AddTwoInts, 'add')", "Action(Fibonacci, 'count')")


@pytest.mark.parametrize("kind", [str, 5, "std_msgs/msg/String", AddTwoInts])
def test_what_is_no_message_class_is_refused(kind: Any) -> None:
    with pytest.raises(DeclarationError, match=r"the type must be a message class, such as std_msgs\.msg\.String"):
        Topic(kind, "words")


def test_a_name_instead_of_a_message_class_is_refused_with_what_finds_the_class() -> None:
    with pytest.raises(DeclarationError, match=r"; by its name, the class is get_message\('std_msgs/msg/String'\)$"):
        Topic("std_msgs/msg/String", "words")  # type: ignore[arg-type]


def test_what_is_no_service_or_action_type_is_refused() -> None:
    with pytest.raises(DeclarationError, match=r"not a service type; one has \.Request and \.Response"):
        Service(String, "add")  # type: ignore[arg-type]
    with pytest.raises(DeclarationError, match=r"not an action type; one has \.Goal, \.Result and \.Feedback"):
        Action(AddTwoInts, "count")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["1bad", "a b", "a//b", "a-", "", "/", "a/", "{x}/a", "~x"])
def test_a_name_that_no_node_could_use_is_refused_by_every_kind_of_contract(name: str) -> None:
    for make in (
        lambda: Topic(String, name),
        lambda: Service(AddTwoInts, name),
        lambda: Action(Fibonacci, name),
    ):
        with pytest.raises(DeclarationError) as caught:
            make()
        assert repr(name) in str(caught.value)


@pytest.mark.parametrize("name", ["a", "/a/b", "~/private", "{node}/x", "{ns}/x", "a_b/C3"])
def test_a_name_that_a_node_can_use_is_taken(name: str) -> None:
    assert Topic(String, name).name == name


def test_decorators_leave_their_declarations_on_the_method_innermost_first() -> None:
    @NUMBERS.on(qos=3, concurrent=2)  # type: ignore[arg-type]
    @WORDS.on()
    async def take(self: Any, message: Any) -> None: ...

    inner, outer = declarations_of(take)
    assert isinstance(inner, TopicHandler)
    assert isinstance(outer, TopicHandler)
    assert (inner.topic, inner.qos, inner.concurrent) == (WORDS, qos.DEFAULT, 0)
    assert (outer.topic, outer.qos.depth, outer.concurrent) == (NUMBERS, 3, 2)
    assert repr(outer) == "@Topic(Int32, 'numbers').on()"
    assert declarations_of(handler) == ()


def test_the_decorators_of_services_and_actions() -> None:
    @ADD.serve(concurrent=4)
    async def add(self: Any, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response()

    @COUNT.serve(arrivals=queue(3), result_timeout=-1.0)
    async def count(self: Any, goal: Fibonacci.Goal) -> Any:
        yield

    @COUNT.accepts
    def check(self: Any, goal: Fibonacci.Goal) -> None: ...

    @COUNT.cancels
    def may_cancel(self: Any, goal: Fibonacci.Goal) -> bool:
        return True

    (served,), (worked,) = declarations_of(add), declarations_of(count)
    (accepts,), (cancels,) = declarations_of(check), declarations_of(may_cancel)
    assert isinstance(served, ServiceHandler)
    assert isinstance(worked, ActionHandler)
    assert isinstance(accepts, GoalHook)
    assert isinstance(cancels, GoalHook)
    assert (served.service, served.concurrent, repr(served)) == (ADD, 4, "@Service(AddTwoInts, 'add').serve()")
    assert (worked.action, repr(worked.arrivals), worked.result_timeout) == (COUNT, "queue(3)", -1.0)
    assert repr(worked) == "@Action(Fibonacci, 'count').serve()"
    assert (accepts.verb, cancels.verb) == ("accepts", "cancels")
    assert repr(accepts) == "@Action(Fibonacci, 'count').accepts"


@pytest.mark.parametrize(
    ("arrivals", "policy", "size"),
    [
        ("reject", "reject", 1), ("preempt", "preempt", 1), ("queue", "queue", 10), ("parallel", "parallel", 1000),
        (queue(2), "queue", 2), (parallel(7), "parallel", 7),
    ],
)  # fmt: skip
def test_arrivals_are_a_word_or_a_limit(arrivals: Any, policy: str, size: int) -> None:
    @COUNT.serve(arrivals=arrivals)
    async def count(self: Any, goal: Fibonacci.Goal) -> Any:
        yield

    (declaration,) = declarations_of(count)
    assert isinstance(declaration, ActionHandler)
    assert (declaration.arrivals.policy, declaration.arrivals.size) == (policy, size)


def test_what_a_decorator_cannot_use_is_refused() -> None:
    with pytest.raises(
        DeclarationError, match=r"arrivals='random' is none of reject, preempt, queue, parallel, queue\(n\)"
    ):
        COUNT.serve(arrivals="random")  # type: ignore[arg-type]
    with pytest.raises(DeclarationError, match=r"queue\(0\): the limit must be at least 1"):
        queue(0)
    with pytest.raises(DeclarationError, match=r"parallel\(-1\): the limit must be at least 1"):
        parallel(-1)
    with pytest.raises(DeclarationError, match=r"concurrent=-1 must be 0 .* or more"):
        NUMBERS.on(concurrent=-1)
    with pytest.raises(DeclarationError, match="concurrent=-2 must be 0"):
        ADD.serve(concurrent=-2)
    with pytest.raises(DeclarationError, match=r"@Topic\(Int32, 'numbers'\)\.on\(\) decorates a method, not 5"):
        NUMBERS.on()(5)  # type: ignore[arg-type]


def test_last_items_read_well() -> None:
    assert repr(Done(Int32(data=1))) == "Done(std_msgs.msg.Int32(data=1))"
    assert repr(Aborted(Int32(data=1), "blocked")) == "Aborted(std_msgs.msg.Int32(data=1), 'blocked')"
    assert Aborted(Int32()).reason == "aborted by its body"
