"""What the tests of the tutorials share."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from actors import Child, transient
from robot.tutorials.program import Job


def alone(job: type[Job], **parameters: object) -> Child:
    """A client without its server, that is not started again when it is done."""
    return Child(job, restart=transient, parameters=parameters)


def increasing(values: Iterable[float]) -> bool:
    """Whether each value is greater than the one before."""
    listed = list(values)
    return all(a < b for a, b in pairwise(listed))
