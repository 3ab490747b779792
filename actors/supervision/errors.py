"""The errors of supervisors: those with which a supervisor fails, and those with which it refuses a request."""

from __future__ import annotations

from actors.errors import ActorError
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef, Down


class SupervisionError(ActorError):
    """Base of the errors that a supervisor raises."""


class StartFailed(SupervisionError):
    """A child did not start. `path` leads from the root to the child at fault, at any depth.

    The exception of its start phase, with its traceback, is the `__cause__` of this error.
    """

    def __init__(self, path: tuple[str, ...], why: str) -> None:
        super().__init__(f"{path[-1]} did not start: {why} (in the tree: {'/'.join(path)})")
        self.path = path

    @property
    def child(self) -> str:
        return self.path[-1]


class SupervisorGaveUp(SupervisionError):
    """A supervisor reached its restart intensity and has stopped all its children.

    `path` is that of the supervisor, `child` the id of the child that failed last, and `reason` the reason of its end.
    `restarts` restarts were allowed in any `within` seconds. The child's exception is the `__cause__` of this error.
    """

    def __init__(self, path: tuple[str, ...], child: str, restarts: int, within: float, reason: ExitReason) -> None:
        super().__init__(
            f"supervisor {'/'.join(path)} gave up: restart intensity reached: {child} needs another restart, and "
            f"{restarts} within {within:g} s are allowed. Its last end: {reason}"
            if restarts
            else f"supervisor {'/'.join(path)} gave up: {child} has ended, and is not to be restarted: {reason}"
        )
        self.path = path
        self.child = child
        self.restarts = restarts
        self.within = within
        self.reason = reason


class SupervisorDown(SupervisionError):
    """The supervisor has not been started, is stopping or has ended, so it cannot serve the request."""


class NotFound(SupervisionError):
    """The supervisor has no such child."""


class AlreadyStarted(SupervisionError):
    """A child with this id is running already; `ref` is its reference."""

    def __init__(self, supervisor: str, ref: ChildRef) -> None:
        super().__init__(f"{supervisor} already runs {ref.id} ({ref}); give the new child another name")
        self.ref = ref


class AlreadyPresent(SupervisionError):
    """There is a child with this id that is not running; `restart_child` starts it, `delete_child` forgets it."""


class Running(SupervisionError):
    """The request needs a stopped child, but the child is running; `ref` is its reference."""

    def __init__(self, supervisor: str, ref: ChildRef) -> None:
        super().__init__(f"{supervisor}: {ref.id} is running ({ref}); terminate_child({ref.id!r}) first")
        self.ref = ref


class Restarting(SupervisionError):
    """The request needs a stopped child, but the child is being started, or waits for its next attempt."""


class TooManyChildren(SupervisionError):
    """The dynamic supervisor has `max_children` children already."""


class LinkBroken(SupervisionError):
    """This child was ended because a child to which it is linked failed; `down` says which one, and why."""

    def __init__(self, down: Down) -> None:
        super().__init__(f"linked to {down}")
        self.down = down
