"""The lifecycle machine: every edge, every refusal, every way a hook can end."""

from __future__ import annotations

from collections.abc import Callable

import pytest

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

UNCONFIGURED = LifecycleState.UNCONFIGURED
INACTIVE = LifecycleState.INACTIVE
ACTIVE = LifecycleState.ACTIVE
FINALIZED = LifecycleState.FINALIZED
PRIMARY = (UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED)
LABELS = ("configure", "cleanup", "activate", "deactivate", "shutdown")
EDGES = {
    (UNCONFIGURED, "configure"): INACTIVE,
    (INACTIVE, "cleanup"): UNCONFIGURED,
    (INACTIVE, "activate"): ACTIVE,
    (ACTIVE, "deactivate"): INACTIVE,
    (UNCONFIGURED, "shutdown"): FINALIZED,
    (INACTIVE, "shutdown"): FINALIZED,
    (ACTIVE, "shutdown"): FINALIZED,
}


def all_well(_: LifecycleHook) -> HookResult:
    return HookResult.SUCCESS


def answering(**answers: HookResult | Exception) -> Callable[[LifecycleHook], HookResult]:
    def run(hook: LifecycleHook) -> HookResult:
        answer = answers.get(hook.name, HookResult.SUCCESS)
        if isinstance(answer, Exception):
            raise answer
        return answer

    return run


def test_there_are_four_states_to_rest_in_and_the_first_is_unconfigured() -> None:
    assert [state.label for state in STATES if state.is_primary] == [
        "unknown",
        "unconfigured",
        "inactive",
        "active",
        "finalized",
    ]
    assert len(STATES) == 11
    machine = LifecycleMachine()
    assert machine.state is UNCONFIGURED
    assert repr(machine) == "<lifecycle: unconfigured>"


@pytest.mark.parametrize(("start", "label"), EDGES)
def test_all_seven_edges_work(start: LifecycleState, label: str) -> None:
    machine = LifecycleMachine(start)
    assert machine.change(all_well, label)
    assert machine.state is EDGES[start, label]


@pytest.mark.parametrize("start", PRIMARY)
@pytest.mark.parametrize("label", LABELS)
def test_every_other_transition_is_refused_with_the_state_named(start: LifecycleState, label: str) -> None:
    if (start, label) in EDGES:
        return
    seen: list[LifecycleTransition] = []
    machine = LifecycleMachine(start, seen.append)
    with pytest.raises(
        TransitionRefused, match=f"{label!r} is refused: the node is {start.label}; possible from"
    ) as no:
        machine.begin(label)
    assert (no.value.state, no.value.asked) == (start, label)
    assert not machine.change(all_well, label)
    assert (machine.state, seen) == (start, [])


def test_thirteen_pairs_are_refused() -> None:
    assert len([1 for start in PRIMARY for label in LABELS if (start, label) not in EDGES]) == 13


def test_finalized_has_no_exits() -> None:
    machine = LifecycleMachine(FINALIZED)
    assert machine.available() == ()
    with pytest.raises(TransitionRefused, match="none: it is the end"):
        machine.begin("shutdown")


def test_the_graph_has_25_transitions_with_the_numbers_of_ros() -> None:
    assert [edge.id for edge in TRANSITIONS] == [
        *(1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 20, 21, 22, 30, 31, 32, 40, 41, 42, 50, 51, 52, 60, 61, 62)
    ]
    assert [edge.id for edge in TRANSITIONS if edge.is_request] == [1, 2, 3, 4, 5, 6, 7]
    assert [(edge.id, edge.goal) for edge in LifecycleMachine(INACTIVE).available()] == [
        (2, LifecycleState.CLEANINGUP),
        (3, LifecycleState.ACTIVATING),
        (6, LifecycleState.SHUTTINGDOWN),
    ]


def test_labels_are_resolved_by_state() -> None:
    found = [LifecycleMachine(state).lookup("shutdown") for state in PRIMARY]
    assert [edge.id if edge else None for edge in found] == [5, 6, 7, None]


def test_the_owner_runs_the_hooks_one_at_a_time() -> None:
    machine = LifecycleMachine()
    hook = machine.begin("configure")
    assert hook == LifecycleHook("on_configure", UNCONFIGURED)
    assert machine.state is LifecycleState.CONFIGURING
    assert not machine.succeeded
    assert machine.finish(HookResult.SUCCESS) is None
    assert (machine.state, machine.succeeded) == (INACTIVE, True)


def test_a_failure_goes_back_and_an_error_is_handled() -> None:
    machine = LifecycleMachine()
    machine.begin("configure")
    assert machine.finish(HookResult.FAILURE) is None
    assert (machine.state, machine.succeeded) == (UNCONFIGURED, False)

    machine = LifecycleMachine(ACTIVE)
    machine.begin("deactivate")
    assert machine.finish(HookResult.ERROR) == LifecycleHook("on_error", ACTIVE)
    assert machine.finish(HookResult.SUCCESS) is None
    assert (machine.state, machine.succeeded) == (UNCONFIGURED, False)


@pytest.mark.parametrize("answer", [HookResult.FAILURE, HookResult.ERROR, RuntimeError("no way")])
def test_an_error_that_is_not_handled_is_the_end(answer: HookResult | Exception) -> None:
    machine = LifecycleMachine()
    assert not machine.change(answering(on_configure=HookResult.ERROR, on_error=answer), "configure")
    assert machine.state is FINALIZED


def test_a_hook_that_raises_counts_as_an_error_and_is_kept() -> None:
    machine = LifecycleMachine()
    broken = ValueError("no such port")
    assert not machine.change(answering(on_configure=broken), "configure")
    assert (machine.state, machine.failure) == (UNCONFIGURED, broken)
    assert machine.change(all_well, "configure")
    assert machine.failure is None


def test_a_failed_shutdown_is_finalized_all_the_same() -> None:
    machine = LifecycleMachine(ACTIVE)
    assert not machine.change(answering(on_shutdown=HookResult.FAILURE), "shutdown")
    assert machine.state is FINALIZED


def test_a_request_during_a_transition_is_refused() -> None:
    machine = LifecycleMachine()
    machine.begin("configure")
    for asked in ("shutdown", "configure", "transition_success"):
        with pytest.raises(TransitionRefused, match="the node is configuring; a transition is under way"):
            machine.begin(asked)
    assert machine.finish(HookResult.SUCCESS) is None


def test_a_result_without_a_running_hook_is_refused() -> None:
    machine = LifecycleMachine(INACTIVE)
    with pytest.raises(TransitionRefused, match="'transition_success' is refused"):
        machine.finish(HookResult.SUCCESS)
    assert machine.state is INACTIVE


def test_a_label_beats_the_id_and_an_id_must_fit_the_state() -> None:
    machine = LifecycleMachine(INACTIVE)
    assert machine.change(all_well, "activate", 2)
    assert machine.state is ACTIVE
    assert not machine.change(all_well, transition_id=6)
    assert machine.change(all_well, transition_id=7)
    assert machine.state is FINALIZED
    assert not LifecycleMachine(INACTIVE).change(all_well, "bogus", 3)


def test_the_bare_graph_can_be_walked_without_hooks() -> None:
    machine = LifecycleMachine(INACTIVE)
    assert machine.fire(3).label == "activate"
    assert machine.fire(32).goal is LifecycleState.ERRORPROCESSING
    assert machine.fire(60).goal is UNCONFIGURED
    with pytest.raises(TransitionRefused, match="30 is refused"):
        machine.fire(30)
    assert machine.state is UNCONFIGURED


def test_every_step_is_an_event() -> None:
    seen: list[tuple[str, str]] = []
    machine = LifecycleMachine(on_transition=lambda edge: seen.append((edge.start.label, edge.goal.label)))
    machine.change(answering(on_configure=HookResult.ERROR), "configure")
    assert seen == [
        ("unconfigured", "configuring"),
        ("configuring", "errorprocessing"),
        ("errorprocessing", "unconfigured"),
    ]


def test_publishing_is_over_after_every_exit_from_active() -> None:
    for label, result in [
        ("deactivate", HookResult.SUCCESS),
        ("deactivate", HookResult.ERROR),
        ("shutdown", HookResult.SUCCESS),
        ("shutdown", HookResult.FAILURE),
        ("shutdown", HookResult.ERROR),
    ]:
        machine = LifecycleMachine(ACTIVE)
        machine.change(answering(**{f"on_{label}": result}), label)
        assert not machine.publishes


def test_a_node_may_publish_its_last_words_while_it_leaves_active() -> None:
    spoken: list[tuple[str, bool]] = []
    machine = LifecycleMachine()

    def run(hook: LifecycleHook) -> HookResult:
        spoken.append((hook.name, machine.publishes))
        return HookResult.ERROR if hook.name == "on_deactivate" else HookResult.SUCCESS

    for label in ("configure", "activate", "deactivate", "configure", "activate", "shutdown"):
        machine.change(run, label)
    assert spoken == [
        ("on_configure", False),
        ("on_activate", False),
        ("on_deactivate", True),
        ("on_error", False),
        ("on_configure", False),
        ("on_activate", False),
        ("on_shutdown", True),
    ]
    machine = LifecycleMachine(INACTIVE)
    machine.begin("shutdown")
    assert not machine.publishes


def test_a_deactivation_that_fails_leaves_the_node_publishing() -> None:
    machine = LifecycleMachine(ACTIVE)
    machine.change(answering(on_deactivate=HookResult.FAILURE), "deactivate")
    assert (machine.state, machine.publishes) == (ACTIVE, True)
