"""The gripper: what stops its jaws, and what it tells."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.sim.gripper import SPEED, WIDEST, Gripper

DT = 0.005


def run(gripper: Gripper, between: float | None = None, seconds: float = 1.0) -> None:
    for _ in range(round(seconds / DT)):
        gripper.step(DT, between)


def test_it_is_open_closes_on_nothing_and_opens_again() -> None:
    gripper = Gripper()
    assert (gripper.state.opening, gripper.state.moving) == (WIDEST, False)
    gripper.tell(True)
    gripper.step(DT, None)
    assert gripper.state.moving
    assert gripper.state.opening == pytest.approx(WIDEST - SPEED * DT)
    run(gripper)
    assert (gripper.state.opening, gripper.state.moving, gripper.gripping) == (0.0, False, False)
    gripper.tell(False)
    run(gripper)
    assert gripper.state.opening == WIDEST
    assert repr(gripper) == "<Gripper empty, open 120 mm>"


@given(st.floats(0.001, WIDEST))
def test_it_stops_at_what_is_between_its_jaws_and_keeps_it_until_it_opens(thickness: float) -> None:
    gripper = Gripper()
    gripper.tell(True)
    run(gripper, thickness)
    assert gripper.gripping
    assert gripper.state.opening == thickness
    assert not gripper.state.moving
    gripper.tell(True)
    assert gripper.gripping
    gripper.tell(False)
    assert not gripper.gripping
    run(gripper, thickness)
    assert gripper.state.opening == WIDEST


def test_what_is_thicker_than_its_opening_cannot_be_gripped() -> None:
    gripper = Gripper()
    gripper.tell(True)
    run(gripper, WIDEST + 0.01)
    assert not gripper.gripping
    assert gripper.state.opening == 0.0
