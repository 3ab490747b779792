"""The control items of an inbox: what ends an incarnation, before anything else that waits."""

from __future__ import annotations

__all__ = ["Failure", "StopRequest", "StopServing"]


class Failure:
    """An inbox item that ends the incarnation with the error of a task; `decided`: `on_error` has had its say."""

    __slots__ = ("decided", "error", "label")

    def __init__(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        self.error = error
        self.label = label
        self.decided = decided

    def run(self) -> None:
        raise self.error


class StopServing(BaseException):
    """Ends `Inbox.serve` in an orderly way; not an `Exception`, so no handler's `except` can mistake it for its own."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class StopRequest:
    """An inbox item that ends the node's service."""

    __slots__ = ("reason",)
    label = "stop"

    def __init__(self, reason: str) -> None:
        self.reason = reason

    def run(self) -> None:
        raise StopServing(self.reason)
