"""What `tests.figures pose` makes of patrols, and one short patrol."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import pytest

from tests.figures import pose
from tests.figures.__main__ import main
from tests.figures.fidelity import IDEAL, Fidelity
from tests.figures.pose_run import OnMap, patrol

ONE = OnMap(
    seed=1, poses=100, place=0.01, worst=0.04, heading=0.3, worst_heading=1.0, walked=20.0, goals=2, falls=0, said=[]
)


def test_patrols_are_summed_up_by_their_poses() -> None:
    told = pose.summary([ONE, replace(ONE, seed=2, poses=300, place=0.03, worst=0.02, worst_heading=2.0, falls=1)])
    assert told["rms"] == pytest.approx(sqrt((100 * 0.01**2 + 300 * 0.03**2) / 400))
    assert (told["worst"], told["heading_worst"], told["metres"], told["goals"], told["falls"]) == (
        0.04,
        2.0,
        40.0,
        4,
        1,
    )


@pytest.mark.parametrize(
    ("held", "code"),
    [(ONE, 0), (replace(ONE, place=0.021), 1), (replace(ONE, worst=0.051), 1), (replace(ONE, falls=1), 1)],
)
def test_the_exit_code_says_whether_both_bounds_are_kept(
    held: OnMap, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mujoco")
    asked: list[tuple[int, float, float, Fidelity, str]] = []

    def patrolled(*how: object) -> OnMap:
        asked.append(how)  # type: ignore[arg-type]
        return held

    monkeypatch.setattr(pose, "patrol", patrolled)
    assert main(["pose", "--trials", "1", "--seed", "7", "--sensors", "ideal", "--actuators", "ideal"]) == code
    assert asked == [(7, 0.004, 120.0, IDEAL, "warehouse")]
    assert "sensors ideal, actuators ideal" in capsys.readouterr().out


@pytest.mark.slow(reason="a patrol with a LiDAR")
def test_a_walking_robot_with_a_lidar_that_turns_knows_where_it_is_within_centimetres() -> None:
    pytest.importorskip("mujoco")
    known = patrol(2, 0.004, 6.0, Fidelity())
    assert known.poses == pytest.approx(300, abs=5)
    assert known.walked > 2.0
    assert 0.0 < known.place < 0.02
    assert known.place < known.worst < 0.05
    assert known.said == []
