"""The fence of the motors."""

from __future__ import annotations

from robot.control.fence import Fence


def test_a_fence_follows_the_newest_life_and_refuses_what_an_older_one_says_however_late_it_comes() -> None:
    fence = Fence()

    admitted = [fence.admits(token) for token in (1, 1, 3, 2, 3, 1, 4)]

    assert admitted == [True, True, True, False, True, False, True]
    assert (fence.newest, fence.refused) == (4, 2)


def test_a_fence_goes_on_from_what_an_earlier_one_knew() -> None:
    fence = Fence(7)

    assert not fence.admits(6)
    assert fence.admits(7)
