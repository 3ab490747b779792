"""Callbacks around setting parameters: who is asked when, who may refuse, who is told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from actors import Parameter, SetResult
from actors.parameters import InvalidParameterValue, ParameterBusy, ParameterChange, ParameterStore


@pytest.fixture
def log() -> list[Any]:
    return []


@pytest.fixture
def store(log: list[Any]) -> ParameterStore:
    """A motor controller whose events are in the log."""

    def report(change: ParameterChange) -> None:
        log.append("event")

    store = ParameterStore("/motor_controller", on_event=report)
    store.declare("max_velocity", 1.0)
    store.declare("pid_gains", (1.0, 0.1, 0.01))
    log.clear()
    return store


def three_gains(parameters: Sequence[Parameter]) -> SetResult:
    wrong = any(parameter.name == "pid_gains" and len(parameter.value) != 3 for parameter in parameters)
    return SetResult(False, "pid_gains must have 3 elements") if wrong else SetResult()


def bounded(parameters: Sequence[Parameter]) -> SetResult:
    wrong = any(parameter.name == "max_velocity" and not 0 <= parameter.value <= 10 for parameter in parameters)
    return SetResult(False, "max_velocity must be between 0.0 and 10.0") if wrong else SetResult()


@pytest.mark.parametrize("gains", [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0)])
def test_pid_gains_need_three_elements(store: ParameterStore, gains: tuple[float, ...]) -> None:
    store.add_on_set_callback(three_gains)
    assert store.set_values({"pid_gains": gains}) == SetResult(False, "pid_gains must have 3 elements")
    assert store.values["pid_gains"] == (1.0, 0.1, 0.01)


def test_side_effects_come_only_after_everything_is_accepted(store: ParameterStore, log: list[Any]) -> None:
    store.add_on_set_callback(three_gains)
    store.add_post_set_callback(lambda parameters: log.append([(p.name, store.values[p.name]) for p in parameters]))
    assert not store.set_values({"max_velocity": 5.0, "pid_gains": (1.0, 2.0)}).successful
    assert log == []
    assert store.set_values({"max_velocity": 5.0}).successful
    assert log == ["event", [("max_velocity", 5.0)]]


def test_the_reason_of_the_first_refusal_is_kept(store: ParameterStore) -> None:
    store.add_on_set_callback(three_gains)
    store.add_on_set_callback(bounded)
    result = store.set_values({"max_velocity": 11.0, "pid_gains": (1.0,)})
    assert result == SetResult(False, "max_velocity must be between 0.0 and 10.0")
    assert store.values["max_velocity"] == 1.0


def test_on_set_callbacks_see_values_that_are_not_stored_yet_and_the_last_added_first(
    store: ParameterStore, log: list[Any]
) -> None:
    def seen_by(name: str) -> Any:
        def callback(parameters: Sequence[Parameter]) -> SetResult:
            log.append((name, parameters[0].value, store.values["max_velocity"]))
            return SetResult()

        return callback

    store.add_on_set_callback(seen_by("first"))
    store.add_on_set_callback(seen_by("second"))
    store.set_values({"max_velocity": 2.0})
    assert log == [("second", 2.0, 1.0), ("first", 2.0, 1.0), "event"]


def test_descriptors_are_checked_before_anybody_is_asked(store: ParameterStore, log: list[Any]) -> None:
    def callback(parameters: Sequence[Parameter]) -> SetResult:
        log.append("asked")
        return SetResult()

    store.add_on_set_callback(callback)
    assert not store.set_values({"max_velocity": "fast"}).successful
    assert log == []


def test_a_declaration_asks_and_tells_but_is_not_rewritten(store: ParameterStore, log: list[Any]) -> None:
    store.add_pre_set_callback(lambda parameters: [])
    store.add_on_set_callback(
        lambda parameters: SetResult("bad" not in parameters[0].name, "bad names are not allowed here")
    )
    store.add_post_set_callback(lambda parameters: log.append([parameter.name for parameter in parameters]))
    store.declare("good", 1)
    with pytest.raises(InvalidParameterValue, match="bad names are not allowed here"):
        store.declare("bad", 1)
    assert log == ["event", ["good"]]
    assert not store.has("bad")


def test_pre_set_callbacks_rewrite_the_list_and_their_answers_are_joined(store: ParameterStore) -> None:
    store.declare("copy", 0.0)

    def mirror(parameters: Sequence[Parameter]) -> list[Parameter]:
        return [Parameter("copy", parameters[0].value)]

    store.add_pre_set_callback(lambda parameters: parameters)
    store.add_pre_set_callback(mirror)
    assert store.set([Parameter("max_velocity", 3.0)])[0].successful
    assert (store.values["max_velocity"], store.values["copy"]) == (3.0, 3.0)


def test_a_list_emptied_by_pre_set_callbacks_is_a_failure(store: ParameterStore) -> None:
    handle = store.add_pre_set_callback(lambda parameters: ())
    assert store.set_values({"max_velocity": 3.0}) == SetResult(
        False, "parameter list cannot be empty: the pre-set callbacks left nothing to set."
    )
    handle.remove()
    assert store.set_values({"max_velocity": 3.0}).successful


def test_post_set_callbacks_run_once_for_each_set_and_the_last_added_first(
    store: ParameterStore, log: list[Any]
) -> None:
    store.add_post_set_callback(lambda parameters: log.append(("first", len(parameters))))
    store.add_post_set_callback(lambda parameters: log.append(("second", len(parameters))))
    store.set([Parameter("max_velocity", 2.0), Parameter("pid_gains", (0.0,))])
    store.set_values({"max_velocity": 3.0, "pid_gains": (1.0,)})
    assert [entry for entry in log if entry != "event"] == [
        ("second", 1),
        ("first", 1),
        ("second", 1),
        ("first", 1),
        ("second", 2),
        ("first", 2),
    ]


def test_a_handle_removes_one_registration_and_only_once(store: ParameterStore) -> None:
    first = store.add_on_set_callback(three_gains)
    second = store.add_on_set_callback(three_gains)
    assert repr(first) == "<on-set callback three_gains>"
    first.remove()
    first.remove()
    assert not store.set_values({"pid_gains": ()}).successful
    second.remove()
    assert store.set_values({"pid_gains": ()}).successful


def test_undeclaring_asks_nobody(store: ParameterStore, log: list[Any]) -> None:
    store.add_pre_set_callback(lambda parameters: log.append("pre") or parameters)  # type: ignore[func-returns-value]
    store.add_post_set_callback(lambda parameters: log.append("post"))
    store.undeclare("max_velocity")
    assert log == []


@pytest.mark.parametrize("kind", ["pre", "on", "post"])
@pytest.mark.parametrize(
    "change",
    [
        lambda store: store.set_values({"max_velocity": 9.0}),
        lambda store: store.declare("inner", 1),
        lambda store: store.declare_many("", [("inner", 1)]),
        lambda store: store.undeclare("pid_gains"),
        lambda store: store.set_descriptor("pid_gains", None),
    ],
    ids=["set", "declare", "declare_many", "undeclare", "set_descriptor"],
)
def test_callbacks_cannot_change_parameters_of_their_own_node(store: ParameterStore, kind: str, change: Any) -> None:
    def callback(parameters: Sequence[Parameter]) -> Any:
        change(store)

    handle = getattr(store, f"add_{kind}_set_callback")(callback)
    with pytest.raises(ParameterBusy, match="a parameter callback of node /motor_controller tried to change"):
        store.set_values({"max_velocity": 2.0})
    assert store.values["max_velocity"] == (2.0 if kind == "post" else 1.0)
    handle.remove()
    assert store.set_values({"max_velocity": 3.0}).successful


def test_an_answer_that_is_no_result_is_a_bug_and_nothing_is_stored(store: ParameterStore) -> None:
    store.add_on_set_callback(lambda parameters: True)  # type: ignore[arg-type, return-value]
    with pytest.raises(TypeError, match=r"<lambda> answered True; return SetResult\(\) to accept"):
        store.set_values({"max_velocity": 2.0})
    assert store.values["max_velocity"] == 1.0


def test_a_callable_object_is_named_by_its_repr(store: ParameterStore) -> None:
    class Validator:
        def __call__(self, parameters: Sequence[Parameter]) -> SetResult:
            return SetResult()

        def __repr__(self) -> str:
            return "Validator()"

    assert repr(store.add_on_set_callback(Validator())) == "<on-set callback Validator()>"
