"""The scenarios of topics once more, over two processes."""

from __future__ import annotations

from tests.actors.graph import test_graph_views
from tests.actors.lifecycle import test_lifecycle_nodes
from tests.actors.node import test_nodes, test_standard_services
from tests.actors.topics import test_latched_restarts, test_qos_events, test_topics
from tests.loopback import borrowed

AT_ONCE = "it looks at what was published, or who has come, without letting anything happen in between"
LOGS = "it lists the log lines of one process"
FLOOD = "the network of these tests carries one sample a turn of the loop"
ONE = "it counts what is in the graph of one process"
LOCAL: dict[str, str] = {
    "test_who_comes_late_misses_what_was_volatile": AT_ONCE,
    "test_a_flood_is_bounded_by_the_depth_and_its_losses_are_counted": AT_ONCE,
    "test_relative_names_live_in_the_namespace_of_their_node": AT_ONCE,
    "test_a_topic_is_renamed_from_outside": AT_ONCE,
    "test_a_paused_reader_gets_the_newest_and_its_losses_are_visible": AT_ONCE,
    "test_a_stream_and_a_handler_get_the_same_messages": AT_ONCE,
    "test_a_stream_ends_with_its_block_and_what_waits_can_still_be_taken": AT_ONCE,
    "test_a_forgotten_stream_leaves_the_topic": AT_ONCE,
    "test_the_second_reader_of_a_mismatch_in_another_node_is_reported_too": AT_ONCE,
    "test_an_incompatible_pair_hears_of_it_on_both_sides_and_the_log_says_once_what_to_change": LOGS,
    "test_late_listeners_of_rosout_get_what_was_said_in_the_last_ten_seconds": AT_ONCE,
    "test_a_change_is_told_on_parameter_events": AT_ONCE,
    "test_a_late_listener_of_rosout_gets_what_was_said_before": AT_ONCE,
    "test_a_publisher_that_is_made_on_the_way_up_waits_for_the_activation_too": AT_ONCE,
    "test_a_flood_in_one_node_does_not_starve_the_others": FLOOD,
    "test_a_snapshot_names_who_says_what_to_whom": ONE,
}
"""Scenario tests that say something about one process only, and why."""

for module in (
    test_topics,
    test_qos_events,
    test_latched_restarts,
    test_standard_services,
    test_lifecycle_nodes,
    test_nodes,
    test_graph_views,
):
    tests = borrowed(module, but={name: why for name, why in LOCAL.items() if hasattr(module, name)})
    assert not tests.keys() & globals().keys()
    globals().update(tests)
