"""The runner of action scripts can tell a server that does right from one that does not: cases of our own, right and wrong ones."""

from __future__ import annotations

from typing import Any

import pytest

from tests.conformance.checks.action_status import check
from tests.conformance.checks.common import Skip, Unsupported

ACCEPT = {"op": "goal_request", "goal": "g1", "goal_callback": "accept"}
RESULT = {"op": "get_result", "goal": "g1"}
CANCEL = {"op": "cancel_request", "goal": "g1", "cancel_callback": "accept"}
REFUSED = {"op": "cancel_request", "goal": "g1", "cancel_callback": "reject"}
SIGNAL = {"op": "signal", "goal": "g1"}


def case(steps: list[dict[str, Any]], expect: dict[str, Any], **given: Any) -> dict[str, Any]:
    return {"id": "action_status/ours", "input": {**given, "steps": steps}, "expect": expect}


def succeeded(**execute: Any) -> dict[str, Any]:
    return {"execute": {"set_state": "succeed", **execute}}


WAITING: dict[str, Any] = {"execute": {"wait_for_cancel": True, "set_state": "canceled"}}

RIGHT = {
    "abort": case(
        [ACCEPT, RESULT],
        {"status_sequence": {"g1": ["executing", "aborted"]}, "result_status": {"g1": "aborted"}},
        execute={"set_state": "abort"},
    ),
    "raises": case(
        [ACCEPT, RESULT],
        {"result_status": {"g1": "aborted"}, "result_is_default": {"g1": True}},
        execute={"raises": True, "return_result": True},
    ),
    "goal-callback-raises": case(
        [{**ACCEPT, "goal_callback": "raises"}], {"goal_accepted": {"g1": False}, "tracked_goals": 0}
    ),
    "duplicate-id": case(
        [ACCEPT, ACCEPT], {"goal_accepted": {"g1": False}, "tracked_goals": 1}, **succeeded(wait_for_signal=True)
    ),
    "cancel-refused": case(
        [ACCEPT, REFUSED, SIGNAL, RESULT],
        {"goals_canceling": [], "return_code": "rejected", "status_sequence": {"g1": ["executing", "succeeded"]}},
        **succeeded(wait_for_signal=True),
    ),
    "cancel-then-canceled": case(
        [ACCEPT, CANCEL, RESULT],
        {"status_sequence": {"g1": ["executing", "canceling", "canceled"]}, "result_is_default": {"g1": True}},
        execute={"wait_for_cancel": True, "set_state": "canceled"},
    ),
    "cancel-then-canceled-with-a-result": case(
        [ACCEPT, CANCEL, RESULT],
        {"result_status": {"g1": "canceled"}, "result_is_default": {"g1": False}},
        execute={"wait_for_cancel": True, "set_state": "canceled", "return_result": True},
    ),
    "cancel-after-the-end": case(
        [ACCEPT, CANCEL], {"goals_canceling": [], "return_code": "goal_terminated"}, **succeeded()
    ),
    "cancel-of-an-unknown-goal": case([CANCEL], {"goals_canceling": [], "return_code": "unknown_goal_id"}),
    "cancel-all": case(
        [ACCEPT, {**ACCEPT, "goal": "g2"}, {**CANCEL, "goal": None}],
        {"goals_canceling": ["g1", "g2"], "status": {"g1": "canceled", "g2": "canceled"}},
        execute={"wait_for_cancel": True, "set_state": "canceled"},
    ),
    "result-of-an-unknown-goal": case(
        [RESULT], {"result_status": {"g1": "unknown"}, "result_is_default": {"g1": True}}
    ),
    "result-never-expires": case(
        [ACCEPT, {"op": "wait_sec", "seconds": 5000.0}, {"op": "count_tracked"}, RESULT],
        {"tracked_counts": [1], "result_status": {"g1": "succeeded"}},
        result_timeout_sec=-1,
        **succeeded(),
    ),
    "result-is-kept-for-no-time": case(
        [ACCEPT, {"op": "count_tracked"}, RESULT],
        {"tracked_counts": [0], "result_status": {"g1": "unknown"}},
        result_timeout_sec=0,
        **succeeded(),
    ),
    "result-of-one-who-waits-is-handed-over-though-kept-for-no-time": case(
        [ACCEPT, {**RESULT, "async": True}, SIGNAL],
        {"result_status": {"g1": "succeeded"}},
        result_timeout_sec=0,
        **succeeded(wait_for_signal=True),
    ),
    "two-states": case(
        [ACCEPT, RESULT],
        {"execute_set_state_error": "invalid_transition", "result_status": {"g1": "succeeded"}},
        execute={"set_state": ["succeed", "abort"]},
    ),
    "deferred-then-executed": case(
        [ACCEPT, {"op": "check_status", "goal": "g1"}, {"op": "execute", "goal": "g1"}, RESULT],
        {"checked_statuses": ["accepted"], "execute_called": True, "result_status": {"g1": "succeeded"}},
        handle_accepted="defer",
        **succeeded(),
    ),
    "deferred-canceled-then-executed": case(
        [ACCEPT, CANCEL, {"op": "execute", "goal": "g1"}, RESULT],
        {"status_sequence": {"g1": ["executing", "canceling", "canceled"]}, "status_on_execute_entry": "canceling"},
        handle_accepted="defer",
        execute={"set_state": "canceled"},
    ),
    "feedback-of-many": case(
        [ACCEPT, {**ACCEPT, "goal": "g2"}],
        {"feedback": {"g1": [[1], [2]], "g2": [[1], [2]]}},
        **succeeded(publish_feedback=[[1], [2]]),
    ),
}

WRONG = {
    "accepted-though-rejected": case([ACCEPT], {"goal_accepted": {"g1": False}}),
    "another-sequence": case([ACCEPT], {"status_sequence": {"g1": ["executing", "aborted"]}}, **succeeded()),
    "another-result": case([ACCEPT, RESULT], {"result_is_default": {"g1": True}}, **succeeded(return_result=True)),
    "another-status": case([ACCEPT, RESULT], {"result_status": {"g1": "canceled"}}, **succeeded()),
    "a-state-that-was-refused": case([ACCEPT], {"execute_set_state_error": "invalid_transition"}, **succeeded()),
    "not-forgotten": case([ACCEPT, {"op": "count_tracked"}], {"tracked_counts": [0]}, **succeeded()),
    "not-called": case([ACCEPT], {"execute_called": False}, **succeeded()),
    "other-feedback": case([ACCEPT], {"feedback": {"g1": [[2]]}}, **succeeded(publish_feedback=[[1]])),
    "nobody-canceled": case(
        [ACCEPT, REFUSED], {"goals_canceling": ["g1"]}, execute={"wait_for_cancel": True, "set_state": "canceled"}
    ),
    "another-default": case([{"op": "default_result_timeout"}], {"seconds": 900}),
}


@pytest.mark.parametrize("name", RIGHT)
def test_right_expectations_are_met(name: str) -> None:
    check(RIGHT[name])


@pytest.mark.parametrize("name", WRONG)
def test_wrong_expectations_are_not(name: str) -> None:
    with pytest.raises(AssertionError):
        check(WRONG[name])


def test_what_cannot_be_expressed_says_why() -> None:
    late_success = case(
        [ACCEPT, CANCEL, RESULT],
        {"result_status": {"g1": "succeeded"}},
        execute={"wait_for_cancel": True, "set_state": "succeed"},
    )
    with pytest.raises(Skip, match="cannot succeed any more once its cancel has been accepted"):
        check(late_success)
    unrefused = case([ACCEPT, {**CANCEL, "cancel_callback": "default"}], {"goals_canceling": []}, **WAITING)
    with pytest.raises(Skip, match="rclpy refuses"):
        check(unrefused)


@pytest.mark.parametrize(
    ("vector", "what"),
    [
        (case([{"op": "destroy"}], {}), "step 'destroy'"),
        (case([{**ACCEPT, "priority": 1}], {}), "field 'priority' of the step 'goal_request'"),
        (case([{**ACCEPT, "goal_callback": "perhaps"}], {}), "goal callback 'perhaps'"),
        (case([{**ACCEPT, "execute": {"pause": 1}}], {}), "field of execute 'pause'"),
        (case([ACCEPT], {}, execute={"set_state": "explode"}), "state to set 'explode'"),
        (case([ACCEPT], {}, threads=2), "field of input 'threads'"),
        (case([ACCEPT], {}, handle_accepted="perhaps"), "handle_accepted 'perhaps'"),
        (case([ACCEPT], {"unheard_of": 1}), "expectation 'unheard_of'"),
        (case([{**ACCEPT, "expect": {"unheard_of": 1}}], {}), "expectation 'unheard_of'"),
    ],
)
def test_what_is_not_known_is_a_failure_with_its_name(vector: dict[str, Any], what: str) -> None:
    with pytest.raises(Unsupported, match=f"unsupported {what}"):
        check(vector)
