"""The values by which a supervisor tells about its children: references, descriptions, and notices of their end."""

from __future__ import annotations

from typing import Literal, TypeAlias

import msgspec

from actors.supervision.policy import Kind
from actors.supervision.reasons import ExitReason, Gone


class ChildRef(msgspec.Struct, frozen=True, gc=False):
    """A reference to one incarnation of one child. It equals only references to the same incarnation, even if the id is used again.

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
"""The state of a child: "restarting" while a restart is due or under way; "stopped" when it has ended and no restart is due."""


class ChildInfo(msgspec.Struct, frozen=True):
    """One child, as `children()` lists it. `ref` is the live reference while the child runs, else None."""

    id: str
    kind: Kind
    state: ChildState
    ref: ChildRef | None
    incarnation: int


class Counts(msgspec.Struct, frozen=True):
    """The numbers of a supervisor's children: `specs` are all, `active` those that run, `supervisors` and `workers` those of each kind."""

    specs: int
    active: int
    supervisors: int
    workers: int


class Down(msgspec.Struct, frozen=True):
    """The notice that the incarnation `ref` has ended for `reason`."""

    ref: ChildRef
    reason: ExitReason | Gone

    def __str__(self) -> str:
        return f"{self.ref}: {self.reason}"
