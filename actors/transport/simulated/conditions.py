"""What a simulated link does to the messages on it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Conditions:
    """The state of a link in one direction. Raises ValueError for values that no link has.

    Loss, duplication and reordering are probabilities, drawn for each message. They hit messages sent with best effort as they are; a
    reliable message is sent again until it has arrived, in its order and once, so that it is only late, and those behind it as well.
    """

    delay: float = 0.0005
    """Seconds that each message travels, more than 0."""

    jitter: float = 0.0
    """Seconds that a message may travel longer, drawn evenly from 0 to this. It does not overtake others by it."""

    bandwidth: float = math.inf
    """Bytes a second. What comes faster waits in a queue."""

    loss: float = 0.0
    """The share of messages that are lost, less than 1. A link that passes nothing is cut (`Network.cut`)."""

    duplication: float = 0.0
    """The share of messages that arrive twice."""

    reordering: float = 0.0
    """The share of messages that take twice as long, so that later ones may overtake them."""

    resend: float = 0.2
    """Seconds after which a reliable message that was lost is sent again."""

    def __post_init__(self) -> None:
        if not 0.0 < self.delay < math.inf:
            raise ValueError(f"{self}: the delay must be a finite number of seconds above 0")
        if not self.bandwidth > 0.0:
            raise ValueError(f"{self}: the bandwidth must be above 0 bytes a second")
        for name in ("jitter", "resend"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{self}: {name} must be a finite number of seconds, 0 or more")
        for name in ("loss", "duplication", "reordering"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(f"{self}: {name} must be a share of 0 or more and less than 1")


LAN = Conditions()
"""A good wire between two machines."""

LOOPBACK = Conditions(delay=0.00005)
"""Between two processes of one machine."""
