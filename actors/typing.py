"""The types in the signatures of `actors` that a program seldom has to name: for its annotations and for `isinstance`.

::

    from actors.typing import Observer, Report, Spec

    def nav_stack() -> list[Spec]: ...

Instances come from the functions and classes of `actors`; a program makes none of them itself.
"""

from __future__ import annotations

from actors.actions.client import Goal
from actors.actions.peers import Outcome
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
from actors.runtime.node import ErrorVerdict
from actors.runtime.runtime import NodeRecord
from actors.runtime.timers import Rate, Timer
from actors.supervision.declarations import Spec
from actors.supervision.policy import AutoShutdown, Kind, Restart, StopTimeout, Strategy
from actors.supervision.reasons import Gone
from actors.supervision.refs import ChildInfo, ChildRef, ChildState, Counts, Down
from actors.supervision.report import Context, Report
from actors.supervision.running import Path, RunningSupervisor
from actors.time.clock import Clock
from actors.topics.endpoint import EventStream
from actors.topics.handler import HandlerSubscription
from actors.topics.publisher import Publisher
from actors.topics.stream import Stream

__all__ = [
    "ArrivalPolicy",
    "Arrivals",
    "AutoShutdown",
    "ChildInfo",
    "ChildRef",
    "ChildState",
    "Clock",
    "Context",
    "Counts",
    "Down",
    "Edge",
    "Endpoint",
    "ErrorVerdict",
    "EventStream",
    "Finding",
    "Goal",
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
    "Outcome",
    "ParameterSource",
    "ParameterSources",
    "Path",
    "PrimaryState",
    "Publisher",
    "PublisherDeclaration",
    "Rate",
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
    "Stream",
    "StreamDeclaration",
    "Timer",
    "TopicView",
]
