"""The contract of `actors.transport.protocol.Transport`, as tests that every implementation passes.

A test class of an implementation inherits `TransportContract`, and has a fixture `wire` that makes its transports. `LossContract` and
`PartitionContract` are for wires on which a process can be killed, and which can be cut. No test sleeps or knows which clock runs: it
waits until something is told. That something does *not* come is seen when something later has come on the same way.
"""

import pytest

for _name in ("sessions", "samples", "history", "questions", "losses"):
    pytest.register_assert_rewrite(f"{__name__}.{_name}")

from tests.actors.transport.contract.history import HistoryContract  # noqa: E402  # after the above
from tests.actors.transport.contract.losses import LossContract, PartitionContract  # noqa: E402
from tests.actors.transport.contract.parties import Breakable, Mortal, Wire  # noqa: E402
from tests.actors.transport.contract.questions import QuestionContract  # noqa: E402
from tests.actors.transport.contract.samples import SampleContract  # noqa: E402
from tests.actors.transport.contract.sessions import SessionContract  # noqa: E402

__all__ = ["Breakable", "LossContract", "Mortal", "PartitionContract", "TransportContract", "Wire"]


class TransportContract(SessionContract, SampleContract, HistoryContract, QuestionContract):
    """What every transport guarantees."""
