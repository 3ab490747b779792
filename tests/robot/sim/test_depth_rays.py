"""The ideal depth camera against MuJoCo's rays, and by hand."""

from __future__ import annotations

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Cylinder, Pit, Scene
from robot.scenes.terrain import Ramp
from robot.sim.depth_rays import sight
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model

NOWHERE = Pose2(0.0, 0.0)
CLUTTER = Scene(
    "clutter",
    (-5.0, -5.0, 5.0, 5.0),
    (
        Box(2.0, 0.0, 0.5, 0.7, 0.4, 0.1),
        Cylinder(-1.0, 1.0, 0.3, 0.7),
        Box(1.0, 2.0, 1.0, 0.3, 0.2, 0.8, bottom=0.55),
        Cylinder(1.0, -2.0, 0.2, 1.2, bottom=0.6),
    ),
    NOWHERE,
    NOWHERE,
    pits=(Pit(2.5, -2.0, 1.0, 1.5, 0.4), Pit(-2.0, -2.0, 0.6, 0.6, 0.2)),
    terrain=(
        Ramp(-2.5, 0.5, 1.2, 1.0, 0.4, yaw=2.5),
        Ramp(-1.0, 3.0, 1.0, 0.8, 0.5, bottom=0.2, yaw=-0.4),
        Ramp(3.5, 1.5, 0.8, 0.9, 0.3, bottom=0.3),
    ),
)


def directions(count: int, seed: int) -> np.ndarray:
    rays = np.random.default_rng(seed).normal(size=(count, 3))
    return rays / np.linalg.norm(rays, axis=1)[:, None]


@pytest.mark.parametrize("eye", [(0.1, 0.05, 0.5), (-1.5, 2.0, 0.3), (1.1, 1.2, 1.4)])
def test_rays_end_where_those_of_the_physics_engine_end(eye: tuple[float, float, float]) -> None:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(write_model(CLUTTER, Ground(), 0.002))
    data = mujoco.MjData(model)
    data.qpos[:3] = (0.0, 0.0, 50.0)  # the robot itself is out of sight
    mujoco.mj_forward(model, data)
    rays, hit = directions(4000, seed=3), np.zeros(1, dtype=np.int32)
    expected = np.array([mujoco.mj_ray(model, data, np.array(eye), ray, None, 1, -1, hit) for ray in rays])
    expected[(expected < 0.0) | (expected > 4.0)] = np.inf

    met = sight(CLUTTER.obstacles, CLUTTER.pits, np.array(eye), rays, 4.0, CLUTTER.terrain)

    finite = np.isfinite(expected)
    assert (np.isfinite(met) == finite).all()
    assert met[finite] == pytest.approx(expected[finite], abs=1e-6)
    assert finite.mean() > 0.3


def test_rays_from_an_eye_each_end_where_each_ends_by_itself() -> None:
    rays = directions(2000, seed=4)
    eyes = np.random.default_rng(5).uniform((-1.5, -0.5, 0.3), (0.5, 0.5, 0.5), (2000, 3))

    where = (CLUTTER.obstacles, CLUTTER.pits)
    met = sight(*where, eyes, rays, 4.0, CLUTTER.terrain)

    alone = [sight(*where, *one, 4.0, CLUTTER.terrain)[0] for one in zip(eyes, rays[:, None], strict=True)]
    assert met == pytest.approx(alone, rel=1e-12)
    assert np.isfinite(met).mean() > 0.3


def test_a_ray_into_a_pit_ends_on_its_bottom_or_on_its_far_wall() -> None:
    pit = Pit(2.0, 0.0, 1.0, 1.0, 0.5)
    down = np.array([[0.0, 0.0, -1.0], [0.6, 0.0, -0.8]])
    met = sight((), (pit,), np.array([2.0, 0.0, 0.3]), down, 4.0)
    assert met == pytest.approx([0.8, 0.5 / 0.6])


def test_nothing_is_seen_beyond_the_reach() -> None:
    ahead = np.array([[1.0, 0.0, 0.0]])
    wall = Box(3.5, 0.0, 1.0, 1.0)
    assert sight((wall,), (), np.array([0.0, 0.0, 0.5]), ahead, 2.9).tolist() == [np.inf]
    assert sight((wall,), (), np.array([0.0, 0.0, 0.5]), ahead, 3.1).tolist() == [3.0]
