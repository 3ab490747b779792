"""The error of a child whose machine is lost."""

from __future__ import annotations

from actors.errors import ActorError


class HostLost(ActorError):
    """The agent of `host` did not renew its lease for `seconds`: the machine is down, cut off or too slow, or its agent has ended.

    What ran there for this tree has ended by then, or ends with the machine.
    """

    def __init__(self, host: str, seconds: float) -> None:
        super().__init__(f"host {host} is lost: its lease of {seconds:g} s was not renewed")
        self.host = host
        self.seconds = seconds
