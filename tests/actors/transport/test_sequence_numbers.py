"""Which messages of a publisher are new, and how many are missing, also when somebody else writes numbers in its name."""

from __future__ import annotations

import pytest

from actors.transport.sequence_numbers import SequenceNumbers


def taken(*numbers: int, after: int | None = None) -> tuple[list[int], int]:
    """Those that are new, and how many were lost."""
    kept, lost, new = SequenceNumbers(after), 0, list[int]()
    for number in numbers:
        if kept.is_new(number):
            lost += kept.take(number)
            new.append(number)
    return new, lost


def test_each_is_taken_once_in_order_and_gaps_are_counted() -> None:
    assert taken(1, 2, 2, 5, 4, 6, 2, 5, 6) == ([1, 2, 5, 6], 2)
    assert taken(7, 8) == ([7, 8], 0)
    assert taken(9, 10, after=5) == ([9, 10], 3)
    assert taken(4, 5, after=5) == ([], 0)


@pytest.mark.parametrize("forged", [2**62, 2**63 - 1, 100, 5000, 4, 0, -(2**63)])
def test_a_forged_number_hides_one_message_at_most(forged: int) -> None:
    new, lost = taken(1, 2, 3, forged, *range(4, 40))
    assert set(range(1, 40)) - set(new) <= {4}
    assert lost < 5000


def test_numbers_that_are_forged_again_and_again_hide_one_each_at_most() -> None:
    numbers = [one for number in range(1, 1000) for one in (number, *([10**6 + number] if not number % 10 else []))]
    new, _ = taken(*numbers)
    assert len([one for one in new if one < 1000]) >= 890


def test_what_is_kept_and_sent_again_is_not_new() -> None:
    assert taken(*range(1, 20), *range(10, 21)) == (list(range(1, 21)), 0)
    assert taken(1, 2, 3, 10, 2, 3, 10, 11) == ([1, 2, 3, 10, 11], 6)
