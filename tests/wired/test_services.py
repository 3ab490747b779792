"""The scenarios of services once more, over two processes."""

from __future__ import annotations

from tests.actors.services import test_services
from tests.actors.supervision import test_restarts
from tests.loopback import borrowed

GONE = "no message of ROS 2 takes back a request"
CAUSE = "the error itself does not leave its process, only its type and text"
TURNS = "it counts turns of the loop between client and server"
ONE = "it counts what is in the graph of one process"
AT_ONCE = "it looks at what was published without letting anything happen in between"
LOCAL: dict[str, str] = {
    "test_requests_that_wait_are_counted_for_the_service_they_are_for": ONE,
    "test_a_caller_that_is_canceled_is_forgotten_its_request_is_not_worked_for_nobody": GONE,
    "test_an_exception_in_the_handler_is_that_callers_the_server_lives": CAUSE,
    "test_a_call_that_is_open_when_the_system_stops_hears_that_its_server_has_stopped": TURNS,
    "test_a_streams_messages_do_not_survive_but_a_new_one_listens_from_the_next_start_on": AT_ONCE,
    "test_a_child_whose_declaration_changes_its_name_is_known_by_the_new_one_from_its_next_start_on": AT_ONCE,
    "test_instances_of_a_template_come_and_go_and_free_their_names": ONE,
}
"""Scenario tests that say something about one process only, and why."""

for module in (test_services, test_restarts):
    tests = borrowed(module, but={name: why for name, why in LOCAL.items() if hasattr(module, name)})
    assert not tests.keys() & globals().keys()
    globals().update(tests)
