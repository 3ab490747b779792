"""What dock_status tells, for every stage of docking and leaving."""

from __future__ import annotations

import pytest

from robot.nodes.docking import Stage, State, Task, state_of


@pytest.mark.parametrize("charging", [False, True])
@pytest.mark.parametrize("stage", list(Stage))
def test_whoever_docks_is_docking_from_the_first_stage_on(stage: Stage, charging: bool) -> None:
    assert state_of(Task.DOCK, stage, charging) is State.DOCKING


@pytest.mark.parametrize(
    ("task", "stage", "charging", "state"),
    [
        (Task.DOCK, None, False, State.UNDOCKED),
        (Task.DOCK, None, True, State.DOCKED),
        (Task.UNDOCK, None, False, State.UNDOCKED),
        (Task.UNDOCK, None, True, State.DOCKED),
        (Task.UNDOCK, Stage.RISING, True, State.DOCKED),
        (Task.UNDOCK, Stage.RISING, False, State.UNDOCKED),
        (Task.UNDOCK, Stage.LEAVING, False, State.UNDOCKED),
    ],
)
def test_otherwise_the_charger_tells(task: Task, stage: Stage | None, charging: bool, state: State) -> None:
    assert state_of(task, stage, charging) is state
