"""Diagnostics as in ROS 2: an `Updater` publishes the state of a node on ``/diagnostics``, an `Aggregator` sorts those of all nodes.

The words, levels and parameters are those of diagnostic_updater and diagnostic_aggregator.
"""

from __future__ import annotations

from actors.diagnostics.analyzers import Aggregator
from actors.diagnostics.status import DIAGNOSTICS, DIAGNOSTICS_AGG, Status, Task
from actors.diagnostics.tasks import FrequencyStatus, TimeStampStatus
from actors.diagnostics.updater import Updater

__all__ = [
    "DIAGNOSTICS",
    "DIAGNOSTICS_AGG",
    "Aggregator",
    "FrequencyStatus",
    "Status",
    "Task",
    "TimeStampStatus",
    "Updater",
]
