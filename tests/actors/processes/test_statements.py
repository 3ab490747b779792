"""The statements about the supervisor hold unchanged when each child has a process of its own, on simulated hosts.

These are the tests of `tests/actors/supervision`, as they stand there; only the lives of their scripted children are made elsewhere.
"""

from __future__ import annotations

import pytest

from actors import Supervisor
from actors.time.virtual_loop import VirtualLoop
from tests.actors.processes.scripted import life_in_a_process
from tests.actors.supervision import kit
from tests.actors.supervision.kit import World, virtual
from tests.actors.supervision.test_admin import *  # noqa: F403
from tests.actors.supervision.test_auto_shutdown import *  # noqa: F403
from tests.actors.supervision.test_dynamic_children import *  # noqa: F403
from tests.actors.supervision.test_intensity import *  # noqa: F403
from tests.actors.supervision.test_reports import *  # noqa: F403
from tests.actors.supervision.test_restart import *  # noqa: F403
from tests.actors.supervision.test_restarts import *  # noqa: F403
from tests.actors.supervision.test_shutdown import *  # noqa: F403
from tests.actors.supervision.test_start import *  # noqa: F403
from tests.actors.supervision.test_state import *  # noqa: F403
from tests.actors.supervision.test_upgrade import *  # noqa: F403
from tests.actors.supervision.test_watch import *  # noqa: F403

# These look at the object that is the life, or at its task, which are others here. What they guarantee, other tests of their statement show.
del test_descendants_are_found_by_their_path  # noqa: F821
del test_a_stop_hook_that_raises_is_a_kill_and_keeps_nobody_waiting  # noqa: F821
del test_statuses  # noqa: F821
del test_the_task_of_a_childs_life_is_told_from_all_others  # noqa: F821
del test_the_state_below_a_supervisor_that_does_not_run_is_that_supervisors  # noqa: F821
del test_with_tasks_that_start_eagerly_a_life_is_made_only_when_its_supervisor_knows_of_it  # noqa: F821

# These have a life speak after its end, which a process that was killed cannot, or ask at once what a process tells in a later turn.
del test_a_leaked_child_that_ends_or_says_ready_later_harms_nobody  # noqa: F821
del test_a_child_that_is_killed_while_it_starts_was_shut_down_and_did_not_fail_to_start  # noqa: F821

# This one makes its lives itself, there as here.
del test_nothing_is_kept_for_ended_temporary_children  # noqa: F821

# A thousand processes take long.
del test_a_thousand_children_that_have_ended_leave_nothing_behind  # noqa: F821


@pytest.fixture(autouse=True)
def each_child_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(World, "life", life_in_a_process)
    monkeypatch.setattr(VirtualLoop, "max_spins", 10_000_000)


@virtual
async def test_unknown_input_is_not_fatal() -> None:  # type: ignore[no-redef]
    """As in `test_reports`, but what a process tells is heard in a later turn."""
    world = World()
    async with kit.running(world, Supervisor("root", children=[kit.child("a")])) as supervisor:
        first = world["a"]
        first.started()
        await kit.settle()
        assert world.errors() == ["unexpected a"]
        world.crash("a")
        await kit.settle()
        first.started()
        await kit.settle()
        assert world.errors() == ["unexpected a", "child_terminated a", "unexpected a"]
        assert "once more" in world.reports[1].note
        assert kit.state(supervisor, "a") == "running"
