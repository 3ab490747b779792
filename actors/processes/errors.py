"""The errors with which a child of another process fails when its process does not end by itself in order."""

from __future__ import annotations

from actors.errors import ActorError


class ProcessDied(ActorError):
    """A process ended without being asked to, and without a reason of its own: it exited, or a signal ended it.

    `process` is its id, `how` says what is known of its end.
    """

    def __init__(self, process: int, how: str) -> None:
        super().__init__(f"process {process} has ended: {how}")
        self.process = process
        self.how = how


class ProcessHung(ActorError):
    """The event loop of a process did not turn for `seconds`, and the process was killed. `where` says what it was doing, if that is known."""

    def __init__(self, process: int, seconds: float, where: str) -> None:
        super().__init__(
            f"the event loop of process {process} did not turn for {seconds:g} s{f': {where}' if where else ''}"
        )
        self.process = process
        self.seconds = seconds
        self.where = where


class RemoteError(ActorError):
    """Stands for an error of another process whose class cannot be found in this one. `kind` is the name of that class."""

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(f"{kind}: {text}" if text else kind)
        self.kind = kind
