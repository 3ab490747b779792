"""The numbers of walking to a goal: when to replan, how long to be patient, when to give up."""

from __future__ import annotations

from dataclasses import dataclass, field

from robot.navigation.follow_config import FollowerConfig


@dataclass(frozen=True, slots=True)
class NavigatorConfig:
    """All were chosen, on the built-in worlds and the 30 BARN worlds of `tests.figures barn`, unless they say otherwise."""

    # -- replanning
    pause: float = 0.4
    """Between two plans while following, s: four scans; a plan takes some 10 ms (measured)."""
    relaxed_pause: float = 1.0
    """The same while nothing is urgent: the way is only less good than it was, or there is none, s."""
    look: float = 2.5
    """The stretch of the path on which something newly seen matters, m: three seconds of walking. A goal that is farther away may be taken."""
    side_room: float = 0.30
    """A path on which the body's side comes this near to something seen is worth replanning, m: just below the follower's comfort."""
    gain: float = 0.85
    """A new path must cost less than this share of the old one: two ways round a thing differ by less, and would take turns."""
    off_path: float = 0.6
    """Farther from its path than this the robot plans from where it is, m: about half its length."""

    # -- poses through a narrow place
    poses_pause: float = 0.5
    """Between two searches for poses, s: one takes some 50 ms where it finds nothing (measured)."""
    misfits: int = 2
    """After so many failures to find poses another way is looked for: one may be due to a single bad scan."""
    contact: float = 0.05
    """But only where the passage is narrower than this about the outline, m: a cell of the map."""
    release: float = 1.0
    """Blocked for longer than this, the poses are given up for the path, s."""

    # -- patience
    patience: float = 8.0
    """How long to wait for something in the way to move, before the recoveries begin, s: a person who crosses the way at walking pace is gone by then."""
    held: float = 3.0
    """Blocked for longer than this although there is a path, the recoveries begin, s."""
    most_recoveries: int = 12
    """In all, for one goal: three times each of the four."""
    recovered: float = 1.0
    """So far from where the last recovery began, the next starts with the first manoeuvre again, m: twice what counts as progress."""
    near_goal: float = 4.0
    """So near to the goal each manoeuvre is tried once, m: what closes the way there is about the goal itself, and seen from all sides it stays there."""
    most_walked: float = 3.0
    """A robot that has walked so many times the longest way that was planned, and `aside` more, will not arrive."""
    aside: float = 20.0
    """m."""

    # -- a straight way, which may not be left
    straight_look: float = 0.3
    """How far beyond the distance in which it stops the body looks ahead, m."""
    braking: float = 0.8
    """What that distance is computed with, m/s2."""

    # -- footing, where an elevation map is heard
    sight: float = 2.5
    """So far ahead along the path the floor must be seen for full speed, m: the body's front half, and what it takes to stop from 1.6 m/s."""
    sight_room: float = 0.8
    """What of the seen floor is not for braking, m: the body's front half, and a step of its legs."""
    groping_speed: float = 0.2
    """Speed towards floor that is not seen at all, m/s: it shows when the robot is near."""
    step_speed: float = 0.3
    """Speed over steps, m/s; chosen: slower than the 0.5 m/s of the box field (docs/reference/figures.md)."""
    step_ahead: float = 1.2
    """That begins so far before a step, m."""
    slope_speed: float = 0.3
    """Speed on slopes that the map shows, m/s; chosen: at 0.4 m/s the legs find the ground behind the crest of 20 degrees, at 0.7 they do not."""
    slope_ahead: float = 0.9
    """That begins so far before a slope, m; chosen: the body's front half, and a step of its legs."""

    # -- time
    latency: float = 0.1
    """From a pose estimate to the body answering the command it led to, s: two control periods of 50 ms."""
    first_step: float = 0.05
    """What the first step of a goal counts for, s: a control period."""
    longest_step: float = 0.2
    """A longer pause between two steps counts for this much, s: speed must not jump after it."""
    usual_pace: float = 0.75
    """Share of the highest speed that arrival times are computed with."""

    # -- the path itself
    following: FollowerConfig = field(default_factory=FollowerConfig)
    """How it is followed."""
