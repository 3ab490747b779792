"""Nodes of two processes, by DDS."""

from __future__ import annotations

import os
from functools import partial

from actors.transport import Transport
from actors.transport.dds import DdsConfig, DdsTransport
from tests.benchmarks._wire import Work, ours


def dds(port: int, work: Work) -> Transport:
    os.environ["ROS_DOMAIN_ID"] = str(port % 200)
    return DdsTransport(DdsConfig(discovery_range="LOCALHOST"))


far, near, until_first = (partial(each, joined=dds) for each in (ours.far, ours.near, ours.until_first))
