"""The numbers of following a path. All were chosen, on the built-in worlds and the 30 BARN worlds of `tests.figures barn`; distances are of the
body's outline unless its middle is named.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FollowerConfig:
    """What the follower wants, what it allows, and what a command costs that is not quite what it wants."""

    # -- the path
    spacing: float = 0.05
    """Between the points of the path that is followed, m: the map's cell."""
    search_back: float = 0.1
    """How far behind the place on the path reached last the next is looked for, m."""
    search_ahead: float = 1.0
    """How far ahead, m: less than a loop of a path."""

    # -- pursuit: a turn towards a point ahead, a sideways step towards the path
    lookahead: float = 0.35
    """Distance of that point along the path at rest, m."""
    lookahead_time: float = 0.5
    """How much of the speed is added to it, s."""
    turn_from: float = 0.7
    """A point farther to the side than this is turned to on the spot, rad."""
    turn_until: float = 0.2
    """So far does such a turn go, rad."""
    turn_gain: float = 1.8
    """Turning rate per bearing of the point, 1/s."""
    side_gain: float = 0.8
    """Sideways speed per distance from the path, 1/s."""
    bend: float = 1.4
    """The speed falls with the cosine of so many times the bearing."""
    least_share: float = 0.2
    """But not below this share."""
    braking: float = 0.4
    """Deceleration towards the goal, m/s2."""
    usual_room: float = 0.21
    """A goal with more room around it than this (m) need not be come to rest at before the far side of that room."""
    least_braking: float = 0.02
    """Distance from which the speed at the goal itself is computed, m: it never starts from zero."""

    # -- poses: through a gap, and the last steps
    approach: float = 0.45
    """Within this distance of the goal the robot steps sideways and backward as need be, m."""
    approach_speed: float = 0.35
    """m/s."""
    approach_gain: float = 1.2
    """Speed per distance from the pose, 1/s."""
    threading_gain: float = 3.0
    """The same through a gap, where the next pose is near."""
    threading_speed: float = 0.9
    """Faster than this it could not stop within what it looks ahead there, m/s."""
    yaw_gain: float = 1.25
    """Of the turn, per gain of the way: the heading is reached first."""
    yaw_length: float = 0.4
    """Metres that count as much as turning by a radian."""
    pose_ahead: float = 0.25
    """How far ahead the pose lies that is aimed at, m with turning."""
    no_way: float = 1e-6
    """What a distance is divided by at least, m: no division by zero on the pose itself."""
    no_speed: float = 1e-3
    """The same for limits of speed, m/s: some bodies do not walk sideways or backward."""
    poses_searched: int = 8
    """Among how many poses ahead the nearest is looked for."""

    # -- clearance
    comfort: float = 0.32
    """While the body keeps this clear of everything, the pursuit is taken as it is, m."""
    touch: float = 0.06
    """No command may bring the outline nearer than this, m."""
    squeeze: float = 0.03
    """The same while threading a gap or taking the last steps to a goal: both were checked beforehand, m."""
    tight: float = 0.12
    """Sliding along the path nearer than this to something calls for a plan of the body's heading too, m."""
    tight_turn: float = 0.6
    """And so does a turn by more than this (rad) in a place where the body cannot turn."""
    tight_look: float = 0.4
    """How far ahead along the path that turn is looked for, m."""
    insistence: float = 0.04
    """In a narrow place, so much less than the path offers is insisted on, m."""
    offered_over: float = 1.2
    """What the path offers is its least over this distance, m."""
    ease: float = 0.02
    """Between what is insisted on and what is allowed there is at least this much, m."""
    flutter: float = 0.03
    """Once off the pursuit it is taken up again only when it is better by this, m."""
    rounding: float = 0.01
    """Clearances closer than this are the same, m: a fifth of a cell."""

    # -- the price of a command that is not the pursuit's: metres of path
    price_over: float = 1.6
    """How far ahead the path is compared with where a command leads, m."""
    price_ahead: float = 0.5
    """The heading is compared with the direction of a point so much farther along the path, m."""
    closeness_price: float = 1.5
    """For the square of the share of comfort that is missing."""
    off_price: float = 0.8
    """Per metre off the path."""
    turn_price: float = 0.3
    """Per radian off the path's direction."""
    change_price: float = 0.05
    """Per m/s and rad/s off what was wanted, and again off the last command: no flutter."""
    slower: tuple[float, float] = (0.6, 0.3)
    """Shares of the pursuit's own command that are tried, too."""
    fan: tuple[float, ...] = (0.15, 0.3, 0.5, 0.7, 1.0)
    """Shares of the highest forward speed in the fan of commands."""
    fan_turns: int = 9
    """Turning rates in the fan."""
