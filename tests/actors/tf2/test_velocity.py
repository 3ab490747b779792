"""Velocities: the values that tf2's own tests state, and a point of the body followed by numpy and scipy."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from actors.interfaces.builtin_interfaces.msg import Time as Stamp
from actors.interfaces.geometry_msgs.msg import VelocityStamped
from actors.tf2 import (
    Buffer,
    ForwardExtrapolationException,
    InvalidArgumentException,
    LookupException,
    Transform,
    stamped,
)
from actors.time import Duration, Time, stamp_of


def at(seconds: float) -> Stamp:
    return stamp_of(round(seconds * 1e9))


def xyz(vector: Any) -> tuple[float, float, float]:
    return (vector.x, vector.y, vector.z)


def linear(velocity: VelocityStamped) -> Any:
    return pytest.approx(xyz(velocity.velocity.linear), abs=1e-6)


def angular(velocity: VelocityStamped) -> Any:
    return pytest.approx(xyz(velocity.velocity.angular), abs=1e-6)


def told(bar: dict[float, Transform]) -> Buffer:
    """`bar` in `foo` over time; two frames stand still beside foo, 1 m along its x, and 1 m above it."""
    buffer = Buffer()
    for seconds, transform in bar.items():
        buffer.set_transform(stamped("foo", "bar", transform, at(seconds)))
    buffer.set_transform_static(stamped("foo", "child", Transform((1.0, 0.0, 0.0)), Stamp()))
    buffer.set_transform_static(stamped("parent", "foo", Transform((0.0, 0.0, -1.0)), Stamp()))
    return buffer


# -- as tf2's tests have it -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("observer", ["foo", "child", "parent"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_slides_has_the_same_velocity_for_all_who_stand_still(observer: str, axis: int) -> None:
    direction = np.eye(3)[axis]
    buffer = told({t / 10: Transform(tuple(direction * t / 10)) for t in range(1, 11)})
    velocity = buffer.lookup_velocity("bar", observer, at(0.5), 0.1)
    assert tuple(direction) == linear(velocity)
    assert angular(velocity) == (0.0, 0.0, 0.0)
    assert (velocity.header.frame_id, velocity.body_frame_id, velocity.header.stamp) == (observer, "bar", at(0.5))


@pytest.mark.parametrize(
    ("axis", "observer", "expected"),
    [
        (0, "foo", (0.0, 0.0, 0.0)),
        (1, "foo", (0.0, 0.0, 0.0)),
        (2, "foo", (0.0, 0.0, 0.0)),
        (0, "child", (0.0, 0.0, 0.0)),
        (1, "child", (0.0, 0.0, -1.0)),
        (2, "child", (0.0, 1.0, 0.0)),
        (0, "parent", (0.0, -1.0, 0.0)),
        (1, "parent", (1.0, 0.0, 0.0)),
        (2, "parent", (0.0, 0.0, 0.0)),
    ],
)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_what_turns_moves_where_the_observer_stands(
    axis: int, observer: str, expected: tuple[float, float, float], sense: float
) -> None:
    turned = {t / 10: Transform.from_rpy((0.0, 0.0, 0.0), *(sense * t / 10 * np.eye(3)[axis])) for t in range(1, 11)}
    velocity = told(turned).lookup_velocity("bar", observer, at(0.5), 0.1)
    assert tuple(sense * part for part in expected) == linear(velocity)
    assert tuple(sense * np.eye(3)[axis]) == angular(velocity)


# -- beyond ---------------------------------------------------------------------------------------------------------------------


def pose(t: float) -> Transform:
    """A body that swings and slides."""
    return Transform.from_rpy((sin(t), 2.0 * cos(0.7 * t), 0.1 * t * t), 0.4 * t, sin(1.3 * t), 1.0 - 0.8 * t)


def whole(transform: Transform) -> NDArray[np.float64]:
    matrix = np.eye(4)
    w, x, y, z = transform.rotation
    matrix[:3, :3] = Rotation.from_quat((x, y, z, w)).as_matrix()
    matrix[:3, 3] = transform.translation
    return matrix


@pytest.mark.parametrize("moment", [0.4, 1.1, 2.35])
@pytest.mark.parametrize("reference", ["foo", "bar", "tilted"])
@pytest.mark.parametrize(
    ("place", "point_frame"), [((0.0, 0.0, 0.0), None), ((0.3, -0.2, 0.5), "bar"), ((1.0, 2.0, 3.0), "tilted")]
)
def test_any_point_of_the_body_moves_as_if_it_were_followed(
    moment: float, reference: str, place: tuple[float, float, float], point_frame: str | None
) -> None:
    buffer, tilted = Buffer(), Transform.from_rpy((0.5, -1.0, 0.2), 0.3, 0.9, -0.4)
    for number in range(5000, 30000, 5):
        buffer.set_transform(stamped("foo", "bar", pose(number / 1e4), at(number / 1e4)))
    buffer.set_transform_static(stamped("foo", "tilted", tilted, Stamp()))
    moment += 0.2
    velocity = buffer.lookup_velocity(
        "bar",
        "foo",
        at(moment),
        0.002,
        reference_frame=reference,
        reference_point=place,
        reference_point_frame=point_frame,
    )
    frames = {"foo": np.eye(4), "bar": whole(pose(moment)), "tilted": whole(tilted)}
    there = frames[point_frame or reference] @ [*place, 1.0]
    on_body = np.linalg.inv(whole(pose(moment))) @ there
    moved = (whole(pose(moment + 1e-5)) @ on_body - whole(pose(moment - 1e-5)) @ on_body)[:3] / 2e-5
    turned = (
        Rotation.from_matrix(whole(pose(moment + 1e-5))[:3, :3] @ whole(pose(moment - 1e-5))[:3, :3].T).as_rotvec()
        / 2e-5
    )
    axes = frames[reference][:3, :3].T
    assert xyz(velocity.velocity.linear) == pytest.approx(tuple(axes @ moved), abs=1e-4)
    assert xyz(velocity.velocity.angular) == pytest.approx(tuple(axes @ turned), abs=1e-4)
    assert (velocity.header.frame_id, velocity.reference_frame_id) == (reference, "foo")


def test_a_turning_body_has_the_speed_of_its_own_origin_if_that_is_asked_for() -> None:
    """A carousel: 2 m from the middle, one turn in 4 s."""
    buffer = Buffer()
    for step in range(1, 41):
        angle = pi / 2 * step / 10
        buffer.set_transform(
            stamped("map", "seat", Transform.planar(2.0 * cos(angle), 2.0 * sin(angle), angle), at(step / 10))
        )
    seen = buffer.lookup_velocity("seat", "map", at(2.0), 0.2, reference_point_frame="seat")
    chord = 2.0 * 2.0 * sin(pi / 2 * 0.1) / 0.2
    assert (0.0, -chord, 0.0) == linear(seen)  # at 2 s it is on the left, and goes down
    assert (0.0, 0.0, pi / 2) == angular(seen)
    assert linear(buffer.lookup_velocity("seat", "map", at(2.0), 0.2)) != xyz(seen.velocity.linear)
    own = buffer.lookup_velocity("seat", "map", at(2.0), 0.2, reference_frame="seat")
    assert (0.0, chord, 0.0) == linear(own)  # forwards, for whom sits on it


def test_without_a_time_it_is_the_mean_up_to_the_newest() -> None:
    buffer = told({t / 10: Transform((3.0 * t / 10, 0.0, 0.0)) for t in range(1, 21)})
    newest = buffer.lookup_velocity("bar", "foo", averaging_interval=Duration(seconds=1))
    assert linear(newest) == (3.0, 0.0, 0.0) and newest.header.stamp == at(1.5)
    assert buffer.lookup_velocity("bar", "foo", Time(seconds=1.95), 1.0).header.stamp == at(1.5)


def test_what_is_fixed_does_not_move() -> None:
    buffer = told({1.0: Transform()})
    still = buffer.lookup_velocity("child", "parent")
    assert linear(still) == (0.0, 0.0, 0.0) and angular(still) == (0.0, 0.0, 0.0)


def test_what_is_not_known_or_no_interval_raises() -> None:
    buffer = told({t / 10: Transform() for t in range(1, 11)})
    with pytest.raises(InvalidArgumentException, match="averaging_interval=0"):
        buffer.lookup_velocity("bar", "foo", at(0.5), 0)
    with pytest.raises(LookupException, match="did you mean bar"):
        buffer.lookup_velocity("baz", "foo")
    with pytest.raises(ForwardExtrapolationException):
        buffer.lookup_velocity("bar", "foo", at(3.0))
