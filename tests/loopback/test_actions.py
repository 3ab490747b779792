"""Actions by way of bytes: that they are, and every scenario of actions once more."""

from __future__ import annotations

import pytest

from actors import Done, GoalCanceled, GoalRejected, Node, Reject, Steps
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.testing import Rig
from tests.actors.actions import test_actions
from tests.loopback import actions, borrowed, services
from tests.stage import COUNT, order, result, step


class Server(Node):
    """Keeps what it was given, and what it gave."""

    def __init__(self) -> None:
        self.goal: Fibonacci.Goal | None = None
        self.feedback, self.result = step(1), result(1, 2)

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("too few")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        self.goal = goal
        yield self.feedback
        await self.clock.sleep(float(goal.order))
        yield Done(self.result)


@pytest.fixture(autouse=True)
def linked(monkeypatch: pytest.MonkeyPatch) -> None:
    services.install(monkeypatch)
    actions.install(monkeypatch)


async def test_goals_feedback_and_results_are_other_objects_of_the_same_value(rig: Rig) -> None:
    await rig.start(Server)
    sent = order(1)
    goal = rig.me.send_goal(COUNT, sent)
    async with goal:
        feedback = [one async for one in goal]
        answer = await goal
    server = rig.node(Server)
    assert (server.goal, feedback, answer) == (sent, [server.feedback], server.result)
    assert server.goal is not sent
    assert feedback[0] is not server.feedback
    assert answer is not server.result


async def test_the_reasons_of_a_rejection_and_of_a_cancellation_get_lost(rig: Rig) -> None:
    await rig.start(Server)
    with pytest.raises(GoalRejected) as rejected:
        await rig.send_goal(COUNT, order(-1))
    goal = await rig.send_goal(COUNT, order(5))
    assert await goal.cancel("changed my mind")
    with pytest.raises(GoalCanceled) as canceled:
        await goal
    assert (rejected.value.reason, canceled.value.reason) == ("", "")


REASON = "it compares a reason, for which ROS 2 has no field"
TURNS = "it counts turns of the loop between client and server"
GONE = "no message of ROS 2 takes back a goal that is not accepted yet"
SELF = "that a node waits for itself is known in its own process only"
BUSY = "what a node is busy with is known in its own process only"
LOCAL = {
    "test_an_outcome_can_be_had_as_a_value": REASON,
    "test_D2_a_canceled_body_that_goes_on_is_canceled_again_after_a_thousand_feedbacks": REASON,
    "test_a_canceled_body_that_the_framework_unwinds_is_aborted_with_its_node": REASON,
    "test_a_server_may_reject_a_goal_with_a_reason_before_it_runs": REASON,
    "test_an_acceptance_check_may_take_its_time_and_one_that_fails_rejects": REASON,
    "test_an_acceptance_check_that_returns_a_bool_is_told_to_raise_reject": REASON,
    "test_an_async_acceptance_check_that_returns_false_accepts_no_goal": REASON,
    "test_a_cancel_takes_effect_at_the_await_and_no_feedback_follows": REASON,
    "test_a_second_cancel_changes_nothing": REASON,
    "test_leaving_the_block_cancels_and_waits_for_the_clean_up": REASON,
    "test_D2_the_bodys_own_timeout_fires_inside_it": REASON,
    "test_D2_a_body_that_swallows_cancellations_is_closed_and_reported": REASON,
    "test_D2_a_body_that_insists_on_wrong_items_is_closed_and_blocks_nobody": REASON,
    "test_D3_aborted_hands_over_a_result_and_a_reason": REASON,
    "test_D3_a_body_without_a_last_item_aborts_its_goal": REASON,
    "test_D3_a_body_that_swallows_its_cancellation_and_just_ends_aborts_its_goal": REASON,
    "test_an_exception_in_the_body_aborts_the_goal_and_a_retry_may_succeed": REASON,
    "test_an_exception_in_a_clean_up_aborts_the_canceled_goal": REASON,
    "test_a_reject_out_of_the_body_aborts_the_goal_with_its_reason": REASON,
    "test_a_body_that_awaits_something_canceled_aborts_its_goal_only": REASON,
    "test_arrivals_reject_refuses_while_another_goal_runs": REASON,
    "test_arrivals_preempt_cancels_cleans_up_then_starts": REASON,
    "test_arrivals_queue_runs_one_after_another_and_rejects_beyond_its_size": REASON,
    "test_arrivals_parallel_runs_at_once_and_rejects_beyond_its_size": REASON,
    "test_a_restart_of_the_server_aborts_its_goals_after_their_clean_up": REASON,
    "test_a_stop_of_the_server_aborts_its_goals_and_keeps_what_they_hand_over": REASON,
    "test_a_stop_leaves_the_outcome_of_a_goal_that_was_canceled_or_had_its_last_word": REASON,
    "test_a_server_that_is_killed_aborts_its_goals": REASON,
    "test_the_states_come_in_order": TURNS,
    "test_a_goal_canceled_in_the_very_moment_of_its_acceptance_is_canceled_and_blocks_nobody": TURNS,
    "test_a_client_that_is_canceled_in_the_moment_of_acceptance_cancels_its_goal": TURNS,
    "test_a_client_that_is_canceled_while_its_goal_is_considered_leaves_nothing_behind": GONE,
    "test_a_client_that_goes_while_its_goal_is_considered_preempts_nobody": GONE,
    "test_a_node_that_cancels_its_own_goal_has_its_turn_already": SELF,
    "test_a_goal_that_a_busy_node_does_not_answer_says_with_what_it_is_busy": BUSY,
    "test_a_goal_that_a_node_does_not_answer_while_it_starts_says_so": BUSY,
}
"""Scenario tests that a wire with the messages of ROS 2 cannot carry, and why."""

tests = borrowed(test_actions, but=LOCAL)
assert not tests.keys() & globals().keys()
globals().update(tests)
