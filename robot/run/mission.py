"""The mission of a run: made of the options and checked before anything starts, and judged when all is over."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import cos, hypot, inf, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from actors.suggest import did_you_mean
from cli.command import UsageError
from robot.geometry.planar import Pose2
from robot.model.footprint import Footprint
from robot.model.robot import SPOT, RobotModel
from robot.navigation.navigator import Navigator
from robot.nodes.carrier import Delivery
from robot.planning.errors import NavigationError
from robot.planning.grasp import Spot, stands
from robot.planning.grid import Grid, signed_distance
from robot.run.options import Options
from robot.run.tasks import Fetch, Goal
from robot.scenes.scene import Scene, Thing
from robot.scenes.worlds import WORLDS, get_world

if TYPE_CHECKING:
    from robot.assembly import Mission
    from robot.run.judge import Score, ScoredGoal
    from robot.sim.simulation import Simulation

DOCK_GOAL = "dock"
"""What the patrol's reports call its dock."""
ON_TOP = 0.02
"""A thing may be set down this much lower than the top of what it is to stand on, m."""

SIDES = 8
"""From how many sides it is tried whether there is a place to stand before the thing's new place."""


def get_mission(
    goal: Goal | None, fetch: Fetch | None, scene: Scene, grid: Grid | None = None, model: RobotModel = SPOT
) -> Mission:
    """The patrol, or what `--goal` or `--fetch` ask for. Raises `UsageError` for what this robot cannot do in this world, or on this map of it."""
    if goal is not None:
        return [_goal(goal, scene, grid or Grid.from_scene(scene), model)]
    if fetch is not None:
        return _delivery(fetch, scene)
    if model is not SPOT:
        _check_patrol(scene, grid or Grid.from_scene(scene), model)
    return "patrol"


def _check_patrol(scene: Scene, grid: Grid, model: RobotModel) -> None:
    """Worlds are made for the reference body: refuse one that is too narrow for another."""
    body = Footprint.of(model)
    for number, pose in enumerate(scene.patrol, start=1):
        try:
            Navigator(grid, footprint=body).set_goal(pose, start=scene.start)
        except NavigationError as error:
            raise UsageError(
                f"--robot {model.name}: with {body.length:.2f} x {body.width:.2f} m it cannot reach patrol_{number} in the world {scene.name!r} "
                f"({error}); take another --world, or give it a --goal"
            ) from None


def failure(options: Options, score: Score, body: Simulation) -> str | None:
    """What went wrong in a run that has ended, or was asked for and has not come about, in one line; `None` if there is nothing of the kind.

    A fall comes first, as what else failed may have failed by it. The dock is no task: to have reached it instead of the goal is to have
    failed. Of a patrol, every goal counts by its last try; a try that was refused for want of charge is no failure if the dock was reached.
    """
    if score.fallen_at is not None:
        more = f" and {score.falls - 1} more times" if score.falls > 1 else ""
        return f"the robot fell at {score.fallen_at:.1f} s{more}"
    tasks = [goal for goal in score.goals if goal.name != DOCK_GOAL]
    if options.goal is None and options.fetch is None:
        return _missed(tasks, docked=any(goal.succeeded for goal in score.goals if goal.name == DOCK_GOAL))
    if any(goal.succeeded for goal in tasks):
        return None
    if options.goal is not None:
        x, y, _ = options.goal
        position = body.truth().position
        left = hypot(float(position[0]) - x, float(position[1]) - y)
        asked, how_far = f"--goal {x:g} {y:g}: not reached", f"{left:.1f} m away from it"
    else:
        assert options.fetch is not None
        asked, how_far = f"--fetch {options.fetch.name}: not done", "under way"
    if tasks:
        return f"{asked}: {_outcome(tasks[-1])}"
    docked = ", on its dock" if score.goals and score.goals[-1].succeeded else ""
    return f"{asked}: the robot was {how_far}{docked} when the run ended"


def _missed(tries: Sequence[ScoredGoal], docked: bool) -> str | None:
    """The first goal of a patrol whose last try failed."""
    for goal in {goal.name: goal for goal in tries}.values():
        if not goal.succeeded and not (docked and goal.for_want_of_charge):
            return f"{goal.name} ({goal.x:g}, {goal.y:g}): {_outcome(goal)}"
    return None


def _outcome(goal: ScoredGoal) -> str:
    return goal.outcome + (f": {goal.reason}" if goal.reason else "")


def _goal(goal: Goal, scene: Scene, grid: Grid, model: RobotModel) -> Pose2:
    pose, asked = Pose2(*goal), f"--goal {goal[0]:g} {goal[1]:g}"
    _check_inside(asked, pose.x, pose.y, scene)
    try:
        Navigator(grid, footprint=Footprint.of(model)).set_goal(pose, start=scene.start)
    except NavigationError as error:
        raise UsageError(f"{asked}: {error}") from None
    return pose


def _delivery(asked: Fetch, scene: Scene) -> Delivery:
    found = next((thing for thing in scene.things if thing.name == asked.name), None)
    if found is None:
        raise UsageError(f"--fetch {asked.name}: {_where_else(asked.name, scene)}")
    if asked.to is not None:
        _check_place(found, asked.to, scene)
    return Delivery(asked.name, (found.shape.x, found.shape.y, found.z), asked.to)


def _where_else(name: str, scene: Scene) -> str:
    """Which worlds have such a thing, and what this one has instead."""
    others = [world for world in WORLDS if any(thing.name == name for thing in get_world(world).things)]
    if not others:
        names = [thing.name for thing in scene.things]
        hint = did_you_mean(name.lower(), names, "did", quoted=False) or f"there is {', '.join(names) or 'nothing'}"
        return f"the world {scene.name!r} has no such thing; {hint}"
    return f"the world {scene.name!r} has no {name}; the world {others[0]!r} has one: add --world {others[0]}"


def _check_place(thing: Thing, to: tuple[float, float, float], scene: Scene) -> None:
    """Refuse what no arm could reach from anywhere, or what is inside of something."""
    x, y, z = to
    asked = f"--fetch {thing.name} {x:g} {y:g} {z:g}"
    _check_inside(asked, x, y, scene)
    if z < 0.0:
        raise UsageError(f"{asked}: that is below the floor; give Z of at least 0 m")
    at = np.array([x]), np.array([y])
    top = max((o.height for o in scene.obstacles if signed_distance(o, *at)[0] < 0.0), default=-inf)
    if z < top - ON_TOP:
        raise UsageError(
            f"{asked}: something {top:g} m high stands there; give Z of at least {top:g} m to put it on top"
        )
    navigator, spot = Navigator(Grid.from_scene(scene)), Spot(x, y, z + thing.shape.height / 2)
    for turn in range(SIDES):  # on the way the robot looks at the place from one side; which one is not known yet
        aside = Pose2(x + cos(2 * pi * turn / SIDES), y + sin(2 * pi * turn / SIDES))
        for place in stands(spot, aside):
            with suppress(NavigationError):
                navigator.set_goal(place, start=scene.start)
                return
    raise UsageError(f"{asked}: there is no place to stand from which the arm reaches that")


def _check_inside(asked: str, x: float, y: float, scene: Scene) -> None:
    x0, y0, x1, y1 = scene.bounds
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        raise UsageError(
            f"{asked}: that is outside of the world {scene.name!r}, "
            f"where x is {x0:g} to {x1:g} m and y is {y0:g} to {y1:g} m"
        )
