"""The types in the signatures of `actors` that a program seldom has to name: for its annotations and for `isinstance`.

::

    from actors.typing import Observer, Report, Spec

    def nav_stack() -> list[Spec]: ...

Instances come from the functions and classes of `actors`; a program makes none of them itself.
"""

from __future__ import annotations

from actors.check.checker import Finding
from actors.contracts.contracts import ArrivalPolicy, Arrivals
from actors.graph.queries import Endpoint, NodeGraph
from actors.graph.snapshot import Edge, LinkView, NodeView, ServiceView, Snapshot, TopicView
from actors.inbox.load import HandlerLoad, Load
from actors.lifecycle.node import PrimaryState
from actors.names.identity import Identity
from actors.running.options import ParameterSource, ParameterSources
from actors.running.run import Observer, OpenNode, Run
from actors.running.trees import Runnable
from actors.runtime.declarations import Late, PublisherDeclaration, StreamDeclaration
from actors.runtime.record import NodeRecord
from actors.supervision.declarations import Spec
from actors.supervision.policy import AutoShutdown, Kind, Restart, StopTimeout, Strategy
from actors.supervision.reasons import Gone
from actors.supervision.refs import ChildInfo, ChildRef, ChildState, Counts, Down
from actors.supervision.report import Context, Report
from actors.supervision.running import Path, RunningSupervisor
from actors.topics.events import EventStream
from actors.topics.handler import HandlerSubscription

__all__ = [
    "ArrivalPolicy",
    "Arrivals",
    "AutoShutdown",
    "ChildInfo",
    "ChildRef",
    "ChildState",
    "Context",
    "Counts",
    "Down",
    "Edge",
    "Endpoint",
    "EventStream",
    "Finding",
    "Gone",
    "HandlerLoad",
    "HandlerSubscription",
    "Identity",
    "Kind",
    "Late",
    "LinkView",
    "Load",
    "NodeGraph",
    "NodeRecord",
    "NodeView",
    "Observer",
    "OpenNode",
    "ParameterSource",
    "ParameterSources",
    "Path",
    "PrimaryState",
    "PublisherDeclaration",
    "Report",
    "Restart",
    "Run",
    "Runnable",
    "RunningSupervisor",
    "ServiceView",
    "Snapshot",
    "Spec",
    "StopTimeout",
    "Strategy",
    "StreamDeclaration",
    "TopicView",
]
