"""What a supervisor raises: to its owner when it fails, to a caller whose request makes no sense."""

from __future__ import annotations

from actors.errors import ActorError
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef, Down

__all__ = [
    "AlreadyPresent",
    "AlreadyStarted",
    "LinkBroken",
    "NotFound",
    "Restarting",
    "Running",
    "StartFailed",
    "SupervisionError",
    "SupervisorDown",
    "SupervisorGaveUp",
    "TooManyChildren",
]


class SupervisionError(ActorError):
    """Base of what a supervisor raises."""


class StartFailed(SupervisionError):
    """A child did not start. `path` leads from the root to that child, the one at fault, however deep it is.

    The exception of its start phase, with its traceback, is this error's `__cause__`.
    """

    def __init__(self, path: tuple[str, ...], why: str) -> None:
        super().__init__(f"{path[-1]} did not start: {why} (in the tree: {'/'.join(path)})")
        self.path = path

    @property
    def child(self) -> str:
        return self.path[-1]


class SupervisorGaveUp(SupervisionError):
    """A supervisor reached its restart intensity and has stopped all its children.

    `path` is the supervisor's, `child` the id of the last child to fail, `restarts` how many were allowed `within` so
    many seconds, `reason` how that child ended; its exception is this error's `__cause__`.
    """

    def __init__(self, path: tuple[str, ...], child: str, restarts: int, within: float, reason: ExitReason) -> None:
        super().__init__(
            f"supervisor {'/'.join(path)} gave up: restart intensity reached: {child} needs another restart, and "
            f"{restarts} within {within:g} s are allowed. Its last end: {reason}"
        )
        self.path = path
        self.child = child
        self.restarts = restarts
        self.within = within
        self.reason = reason


class SupervisorDown(SupervisionError):
    """The supervisor is not running (any more, or yet), so it can do nothing for its children."""


class NotFound(SupervisionError):
    """The supervisor has no such child."""


class AlreadyStarted(SupervisionError):
    """A child with this id is running: `ref`."""

    def __init__(self, supervisor: str, ref: ChildRef) -> None:
        super().__init__(f"{supervisor} already runs {ref.id} ({ref}); give the new child another name")
        self.ref = ref


class AlreadyPresent(SupervisionError):
    """A child with this id is known but does not run; `restart_child` starts it, `delete_child` forgets it."""


class Running(SupervisionError):
    """The child must be stopped for this, and it is running: `ref`."""

    def __init__(self, supervisor: str, ref: ChildRef) -> None:
        super().__init__(f"{supervisor}: {ref.id} is running ({ref}); terminate_child({ref.id!r}) first")
        self.ref = ref


class Restarting(SupervisionError):
    """The child must be stopped for this, but it is being started, or waits for its next attempt."""


class TooManyChildren(SupervisionError):
    """The dynamic supervisor is at its `max_children`."""


class LinkBroken(SupervisionError):
    """This child was ended because one that it is linked to failed; `down` tells which and how."""

    def __init__(self, down: Down) -> None:
        super().__init__(f"linked to {down}")
        self.down = down
