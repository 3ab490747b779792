"""The hall with people of `tests.figures crowd`, and the body that notices whom it touches."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from typing import cast

import pytest

from robot.scenes.scene import Box, Cylinder, Walker
from tests.figures.crowd_run import WALKERS, CrowdBody, hall, walk
from tests.robot.stage import floor


def test_a_hall_has_goals_away_from_each_other_and_from_pillars_and_nobody_begins_on_the_robot() -> None:
    scene, goals = hall(3)
    pillars = [one for one in scene.obstacles if isinstance(one, Box) and one.length == 0.4]
    assert len(pillars) == 4
    for before, goal in zip((scene.start, *goals), goals, strict=False):
        assert hypot(goal.x - before.x, goal.y - before.y) > 5.0
        assert all(hypot(goal.x - one.x, goal.y - one.y) > 1.2 for one in pillars)
    assert len(scene.walkers) == WALKERS
    for person in scene.walkers:
        assert 0.5 <= person.speed <= 1.5
        shape = cast("Cylinder", person.shape)
        assert hypot(shape.x - scene.start.x, shape.y - scene.start.y) > 2.0
    assert hall(3) == (scene, goals)
    assert hall(4) != (scene, goals)


def test_somebody_who_walks_into_a_robot_that_stands_is_noticed_and_the_robot_has_not_caused_it() -> None:
    person = Walker(Cylinder(2.0, 0.0, 0.25, 1.75), ((2.0, 0.0), (-2.0, 0.0)), 1.0, room=0.0)
    body = CrowdBody(replace(floor(), walkers=(person,)), seed=1)
    body.advance(0.5)
    assert body.encounters.contacts == []
    body.advance(2.5)
    contact = body.encounters.contacts[0]
    assert (contact.who, contact.caused) == ("walker_0", False)
    assert 0.5 < contact.at < 2.5


@pytest.mark.slow(reason="a minute of walking among people")
def test_a_walk_through_the_hall_begins_and_ends_when_its_time_is_over() -> None:
    outcome = walk(1, 6.0)
    assert (outcome.seed, outcome.goals, outcome.falls) == (1, 0, 0)
    assert 6.0 <= outcome.seconds < 9.0, "the robot sits down at the end"
    assert outcome.walked > 0.1
    assert outcome.caused == 0
