"""The scenarios of actions once more, over two processes."""

from __future__ import annotations

from tests.actors.actions import test_actions
from tests.loopback import borrowed

TURNS = "it counts turns of the loop between client and server"
NO_RESULT = "whether a goal had a result at all is not carried: a client gets an empty one"
GONE = "no message of ROS 2 takes back a goal that is not accepted yet"
BUSY = "what a node is busy with is known in its own process only"
LOCAL: dict[str, str] = {
    "test_the_states_come_in_order": TURNS,
    "test_an_outcome_can_be_had_as_a_value": NO_RESULT,
    "test_a_cancel_takes_effect_at_the_await_and_no_feedback_follows": NO_RESULT,
    "test_a_goal_canceled_in_the_very_moment_of_its_acceptance_is_canceled_and_blocks_nobody": TURNS,
    "test_a_client_that_is_canceled_while_its_goal_is_considered_leaves_nothing_behind": GONE,
    "test_a_client_that_goes_while_its_goal_is_considered_preempts_nobody": GONE,
    "test_a_client_that_is_canceled_in_the_moment_of_acceptance_cancels_its_goal": TURNS,
    "test_a_goal_that_a_busy_node_does_not_answer_says_with_what_it_is_busy": BUSY,
    "test_a_goal_that_a_node_does_not_answer_while_it_starts_says_so": BUSY,
}
"""Scenario tests that say something about one process only, and why."""

globals().update(borrowed(test_actions, but=LOCAL))
