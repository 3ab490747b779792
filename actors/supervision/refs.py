"""What a supervisor hands out about its children: references, descriptions, notices of their end."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from actors.supervision.policy import Kind
from actors.supervision.reasons import ExitReason, Gone

__all__ = ["ChildInfo", "ChildRef", "ChildState", "Counts", "Down"]


class ChildRef(msgspec.Struct, frozen=True):
    """One incarnation of one child. Equal only to references to this very incarnation, also after its id is used again.

    `path` leads from the root of the tree to the child, whose id is its last part.
    """

    path: tuple[str, ...]
    incarnation: int
    serial: int = 0

    @property
    def id(self) -> str:
        return self.path[-1]

    def __str__(self) -> str:
        return f"{'/'.join(self.path)}#{self.incarnation}"

    def __repr__(self) -> str:
        return f"<{self}>"


ChildState: TypeAlias = Literal["starting", "running", "stopping", "restarting", "stopped"]
"""`restarting` while it waits for its next start; `stopped` when it has ended and is not started again by itself."""


class ChildInfo(msgspec.Struct, frozen=True):
    """One line of `children()`. `ref` is the live reference while it runs, else None."""

    id: str
    kind: Kind
    state: ChildState
    ref: ChildRef | None
    incarnation: int


class Counts(msgspec.Struct, frozen=True):
    """`specs`: children known; `active`: of them running; `supervisors` and `workers`: of the known ones."""

    specs: int
    active: int
    supervisors: int
    workers: int


class Down(msgspec.Struct, frozen=True):
    """The incarnation `ref` has ended, for this reason."""

    ref: ChildRef
    reason: ExitReason | Gone

    def __str__(self) -> str:
        return f"{self.ref}: {self.reason}"
