"""`Placement`: which part of which run of a tree a system is, from which the fencing tokens of its nodes follow."""

from __future__ import annotations

from typing import NamedTuple

_BITS = 20
"""A million parts given away in each run, and a million lives of a node at each place, on average; 16 million runs."""


class Placement(NamedTuple):
    """`run` is larger in each run of a tree with other machines than in those before; 0 without other machines. `number` counts how often the
    tree had given a part to another machine before, this part included; 0 for what was not given away.
    """

    run: int = 0
    number: int = 0

    @property
    def away(self) -> bool:
        """Whether it is a part that was given to another machine."""
        return self.number > 0

    def token(self, incarnation: int) -> int:
        """The fencing token of this life of a node. It fits into 64 bits.

        It grows with the run; within a run, with the number of the placement and that of the life, of which neither falls from one life to the next.
        """
        return (self.run << 2 * _BITS) + (self.number << _BITS) + incarnation


HERE = Placement()
"""That of a tree without other machines."""
