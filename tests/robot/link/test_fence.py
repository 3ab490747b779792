"""The fence of the motors."""

from __future__ import annotations

from robot.link.fence import Fence


def test_a_fence_follows_the_newest_life_and_refuses_what_an_older_one_says_however_late_it_comes() -> None:
    fence = Fence()

    admitted = [fence.admits(token) for token in (1, 1, 3, 2, 3, 1, 4)]

    assert admitted == [True, True, True, False, True, False, True]
    assert (fence.newest, fence.refused) == (4, 2)


def test_a_fence_goes_on_from_what_an_earlier_one_knew() -> None:
    fence = Fence(7)

    assert not fence.admits(6)
    assert fence.admits(7)


def test_a_forged_token_locks_out_nobody_for_good() -> None:
    fence = Fence()
    assert fence.admits(1, 0.0)
    assert fence.admits(2**64 - 1, 0.005)
    admitted = [0.005 * step for step in range(2, 1300) if fence.admits(1, 0.005 * step)]
    assert 5.0 <= admitted[0] < 5.1, "the robot has long sat down by then"
    assert len(admitted) > 200


def test_late_commands_of_an_old_life_that_come_all_at_once_are_refused_however_long_the_newest_is_silent() -> None:
    fence = Fence()
    assert fence.admits(9, 0.0)
    assert not any(fence.admits(8, 60.0 + 0.0001 * step) for step in range(1500))
