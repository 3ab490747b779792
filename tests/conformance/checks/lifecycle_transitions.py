"""Vectors of `lifecycle_transitions`: the graph, requests by label and id, results of hooks, gated publishers."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.lifecycle.machine import (
    STATES,
    TRANSITIONS,
    HookResult,
    LifecycleHook,
    LifecycleMachine,
    LifecycleState,
    LifecycleTransition,
    TransitionRefused,
)
from tests.conformance import crossing
from tests.conformance.checks.common import Case, Unsupported, Vector, by_kind, expected, same, steps_of


def cases(path: Path) -> Iterator[Case]:
    """The cases of the vector file `path`."""
    return by_kind(path, _CHECKS)


def _machine(state: str) -> LifecycleMachine:
    return LifecycleMachine(LifecycleState[state.upper()])


def _trigger_by_id(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    machine = _machine(given["state"])
    fired: LifecycleTransition | None = None
    with contextlib.suppress(TransitionRefused):
        fired = machine.fire(given["transition_id"])
    expected(
        expect,
        ok=fired is not None,
        next_state=machine.state.label,
        next_state_id=machine.state.value,
        label=None if fired is None else fired.label,
    )


def _label_lookup(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    found = _machine(given["state"]).lookup(given["label"])
    expected(expect, transition_id=None if found is None else found.id)


def _available_transitions(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    found = _machine(given["state"]).available()
    expected(expect, count=len(found))
    if "transitions" in expect:
        _same_edges(found, expect["transitions"])


def _same_edges(found: Iterable[LifecycleTransition], wanted: list[Vector]) -> None:
    """Fail unless these are the transitions, in this order; what the vectors do not tell of one is not checked."""
    for edge, described in zip(found, wanted, strict=True):
        states = {"start_state": edge.start.label, "goal_state": edge.goal.label}
        ids = {"start_state_id": edge.start.value, "goal_state_id": edge.goal.value}
        expected(described, id=edge.id, label=edge.label, **states, **ids)


def _available_states(vector: Vector) -> None:
    expect = vector["expect"]
    expected(expect, count=len(STATES))
    for described, state in zip(expect["states"], STATES, strict=True):
        if isinstance(described, dict):
            expected(described, id=state.value, label=state.label)
        else:
            same("state", state.label, described)


def _transition_graph(vector: Vector) -> None:
    expect = vector["expect"]
    expected(expect, count=len(TRANSITIONS), labels=sorted({edge.label for edge in TRANSITIONS}))
    if "transitions" in expect:
        _same_edges(TRANSITIONS, expect["transitions"])


def _constant(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    expected(expect, value=_constants()[given["name"]])


def _constants() -> dict[str, int]:
    """The constants of `lifecycle_msgs`, put together from our enumerations and from the graph."""
    named = {f"TRANSITION_CALLBACK_{result.name}": result.value for result in HookResult}
    named |= {"TRANSITION_CREATE": 0, "TRANSITION_DESTROY": 8}
    for state in STATES:
        named[f"{'PRIMARY' if state.is_primary else 'TRANSITION'}_STATE_{state.name}"] = state.value
    hooks = {1: "CONFIGURE", 2: "CLEANUP", 3: "ACTIVATE", 4: "DEACTIVATE", 5: "SHUTDOWN", 6: "ERROR"}
    for edge in TRANSITIONS:
        if not edge.is_request:
            result = edge.label.removeprefix("transition_").upper()
            named[f"TRANSITION_ON_{hooks[edge.id // 10]}_{result}"] = edge.id
        elif edge.label == "shutdown":
            named[f"TRANSITION_{edge.start.name}_SHUTDOWN"] = edge.id
        else:
            named[f"TRANSITION_{edge.label.upper()}"] = edge.id
    return named


def _change(machine: LifecycleMachine, run: Callable[[LifecycleHook], HookResult], label: str, id: int) -> bool:
    """Ask for a transition as a client of the node does."""

    def answer(request: ChangeState.Request) -> ChangeState.Response:
        return ChangeState.Response(success=machine.change(run, request.transition.label, request.transition.id))

    response: ChangeState.Response = crossing.ask(
        ChangeState, answer, ChangeState.Request(transition=Transition(id=id, label=label))
    )
    return response.success


_HOOKS = {"on_configure", "on_cleanup", "on_activate", "on_deactivate", "on_shutdown", "on_error"}


def _change_state_sequence(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    callbacks = dict(given.get("callbacks", {}))
    for name, behavior in callbacks.items():
        if behavior.upper() not in (*HookResult.__members__, "RAISE") or name not in _HOOKS:
            raise Unsupported(f"unsupported callback {name} that does {behavior!r}")
    events: list[list[str]] = []
    machine = LifecycleMachine(on_transition=lambda edge: events.append([edge.start.label, edge.goal.label]))

    def run(hook: LifecycleHook) -> HookResult:
        behavior = callbacks.get(hook.name, "success")
        if behavior == "raise":
            raise RuntimeError(hook.name)
        return HookResult[behavior.upper()]

    responses: list[Vector] = []
    for request in given["requests"]:
        asked = (
            {"label": request} if isinstance(request, str) else {"id": request} if isinstance(request, int) else request
        )
        success = _change(machine, run, asked.get("label", ""), asked.get("id", 0))
        responses.append({"request": request, "success": success, "state": machine.state.label})
    if "responses" in expect:
        for got, wanted in zip(responses, expect["responses"], strict=True):
            expected(wanted, **got)
    expected(expect, transition_events=events)


def _change_state_request(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    machine = _machine(given["state"])
    asked = given["transition"]
    success = _change(machine, lambda _: HookResult.SUCCESS, asked.get("label", ""), asked.get("id", 0))
    expected(expect, success=success, state=machine.state.label)


def _lifecycle_publisher(vector: Vector) -> None:
    expect = vector["expect"]
    machine = LifecycleMachine()
    delivered: list[bool] = []
    for step in steps_of(vector):
        if step == "publish":
            delivered.append(machine.publishes)
        elif step not in {edge.label for edge in TRANSITIONS}:
            raise Unsupported(f"unsupported step {step!r}")
        else:
            assert machine.change(lambda _: HookResult.SUCCESS, step), f"{step} was refused"
    expected(expect, delivered=delivered)


_CHECKS = {
    "trigger_by_id": _trigger_by_id,
    "label_lookup": _label_lookup,
    "available_transitions": _available_transitions,
    "available_states": _available_states,
    "transition_graph": _transition_graph,
    "constant": _constant,
    "change_state_sequence": _change_state_sequence,
    "change_state_request": _change_state_request,
    "lifecycle_publisher": _lifecycle_publisher,
}
