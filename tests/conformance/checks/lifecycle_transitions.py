"""Vectors of `lifecycle_transitions`: the graph, requests by label and id, results of hooks, gated publishers."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from actors.lifecycle import (
    STATES,
    TRANSITIONS,
    HookResult,
    LifecycleHook,
    LifecycleMachine,
    LifecycleState,
    LifecycleTransition,
    TransitionRefused,
)


def cases(path: Path) -> Iterator[tuple[str, str, Callable[[], None]]]:
    """The cases of the vector file `path`: id, tier, and a callable that raises AssertionError."""
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        check = _CHECKS[case["input"]["kind"]]
        yield case["id"], case["tier"], lambda check=check, case=case: check(case["input"], case["expect"])


def _machine(state: str) -> LifecycleMachine:
    return LifecycleMachine(LifecycleState[state.upper()])


def _trigger_by_id(given: dict[str, Any], expect: dict[str, Any]) -> None:
    machine = _machine(given["state"])
    fired: LifecycleTransition | None = None
    with contextlib.suppress(TransitionRefused):
        fired = machine.fire(given["transition_id"])
    assert (fired is not None) == expect["ok"]
    assert machine.state.label == expect["next_state"]
    if "next_state_id" in expect:
        assert machine.state.value == expect["next_state_id"]
    if "label" in expect:
        assert fired is not None
        assert fired.label == expect["label"]


def _label_lookup(given: dict[str, Any], expect: dict[str, Any]) -> None:
    found = _machine(given["state"]).lookup(given["label"])
    assert (None if found is None else found.id) == expect["transition_id"]


def _available_transitions(given: dict[str, Any], expect: dict[str, Any]) -> None:
    found = _machine(given["state"]).available()
    described = [{"id": edge.id, "label": edge.label, "goal_state": edge.goal.label} for edge in found]
    assert described == expect["transitions"]


def _available_states(_: dict[str, Any], expect: dict[str, Any]) -> None:
    for described, state in zip(expect["states"], STATES, strict=True):
        shown = {"id": state.value, "label": state.label}
        assert described == (shown if isinstance(described, dict) else state.label)


def _transition_graph(_: dict[str, Any], expect: dict[str, Any]) -> None:
    assert len(TRANSITIONS) == expect["count"]
    assert sorted({edge.label for edge in TRANSITIONS}) == expect["labels"]


def _constant(given: dict[str, Any], expect: dict[str, Any]) -> None:
    assert _constants()[given["name"]] == expect["value"]


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


def _change_state_sequence(given: dict[str, Any], expect: dict[str, Any]) -> None:
    events: list[list[str]] = []
    machine = LifecycleMachine(on_transition=lambda edge: events.append([edge.start.label, edge.goal.label]))

    def run(hook: LifecycleHook) -> HookResult:
        behavior = given["callbacks"].get(hook.name, "success")
        if behavior == "raise":
            raise RuntimeError(hook.name)
        return HookResult[behavior.upper()]

    responses = [
        {"request": request, "success": machine.change(run, request), "state": machine.state.label}
        for request in given["requests"]
    ]
    assert responses == expect["responses"]
    assert events == expect["transition_events"]


def _change_state_request(given: dict[str, Any], expect: dict[str, Any]) -> None:
    machine = _machine(given["state"])
    asked = given["transition"]
    success = machine.change(lambda _: HookResult.SUCCESS, asked.get("label", ""), asked.get("id", 0))
    assert {"success": success, "state": machine.state.label} == {key: expect[key] for key in ("success", "state")}


def _lifecycle_publisher(given: dict[str, Any], expect: dict[str, Any]) -> None:
    machine = LifecycleMachine()
    delivered: list[bool] = []
    for step in given["steps"]:
        if step == "publish":
            delivered.append(machine.publishes)
        else:
            assert machine.change(lambda _: HookResult.SUCCESS, step)
    assert delivered == expect["delivered"]


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
