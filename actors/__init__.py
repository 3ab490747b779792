"""ROS 2's communication model as an asyncio-native actor framework.

Nodes are async actors in a supervisor tree; topics, services, actions and parameters are typed contracts between them; one clock, real or
virtual, drives everything. The names below are what most programs need; `docs/reference/README.md` lists them with those of the other public modules.

General layout, from top to bottom. Each room, a folder or a file here, imports only from rooms below it:

    typing       types for annotations: what stands in signatures and is seldom named
    testing      the rig, faults, tests under hundreds of seeds
    check        what is wrong with a tree, or will surprise, before it runs
    blocking     nodes for scripts and threads without an event loop
    launch       launch files of ROS 2 as supervisor trees; packages and their executables
    replay       journals of nodes, and their replay to one node alone
    bag          flight recorder and trace
    nodes        nodes that come with the framework
    diagnostics  the updater of a node's diagnostics, the aggregator of all
    tf2          transforms between frames over time
    message_filters  messages that belong together, by their stamps
    running      `run`, `open_node`, `execute`; signals and the arguments of a program
    hosts        children on other machines
    processes    children in processes of their own
    lifecycle    managed nodes, and the state machine behind them
    system       one running tree
    transport    the way to other processes and machines
    runtime      `Node` and what is declared in its body, its lives, and what the nodes of a system share
    graph        topics, services and actions by name; matching; snapshots
    actions      goals: the client's half, the server's half, the table
    services     calls and their deadlines, cycles of calls
    topics       publishers, subscriptions, streams, QoS events
    inbox        the handlers of a node, one at a time
    parameters   declaration, types, ranges, callbacks, files
    contracts    `Topic`, `Service`, `Action`
    supervision  trees as values, the supervisor that runs one, reasons and reports
    logs         log lines, levels and sinks
    time         `Time`, `Duration`, clocks, tickers, event loops
    images       images and point clouds as arrays
    interfaces   message, service and action types; CDR; type hashes
    checks       checks of arguments
    names        names of ROS, remapping
    qos          policies, profiles, matching
    shield       waiting to the end although one is canceled
    places       the user's line, for errors and logs
    errors       what all rooms raise
    suggest      did you mean
    waiting      lists of tasks that wait
    yaml_bounds  YAML of strangers, bounded before it is understood
    pickle_bounds  pickles of strangers, of which nothing is executed

Reading order: contracts, topics, inbox, then supervision and runtime. `docs/concepts/architecture.md` follows a message and a goal through them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors import qos
from actors.actions.goals import GoalStatus
from actors.check.checker import check_node, check_tree
from actors.contracts.content_filter import ContentFilter
from actors.contracts.contracts import Aborted, Action, Done, Service, Steps, Topic
from actors.errors import (
    ActionUnavailable,
    ActorError,
    CallTimeout,
    DeclarationError,
    GoalAborted,
    GoalCanceled,
    GoalFailed,
    GoalRejected,
    Reject,
    ServiceFailed,
    ServiceUnavailable,
)
from actors.lifecycle.node import LifecycleNode
from actors.parameters.declare import parameter
from actors.parameters.values import Parameter, SetResult
from actors.qos.policies import QoS
from actors.running.program import spin
from actors.running.run import execute, open_node, run
from actors.runtime.declarations import background, every, publishes, subscribes
from actors.runtime.node import Node
from actors.runtime.retry import retry
from actors.runtime.timers import Tick
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import StartFailed, SupervisorGaveUp
from actors.supervision.policy import (
    Backoff,
    Intensity,
    one_for_all,
    one_for_one,
    permanent,
    rest_for_one,
    temporary,
    transient,
)
from actors.supervision.reasons import ExitReason, Skip, Stop
from actors.system import System, graph_of, system_of

__all__ = [
    "Aborted",
    "Action",
    "ActionUnavailable",
    "ActorError",
    "Backoff",
    "CallTimeout",
    "Child",
    "ContentFilter",
    "DeclarationError",
    "Done",
    "DynamicSupervisor",
    "ExitReason",
    "GoalAborted",
    "GoalCanceled",
    "GoalFailed",
    "GoalRejected",
    "GoalStatus",
    "Intensity",
    "LifecycleNode",
    "Node",
    "Parameter",
    "QoS",
    "Reject",
    "Service",
    "ServiceFailed",
    "ServiceUnavailable",
    "SetResult",
    "Skip",
    "StartFailed",
    "Steps",
    "Stop",
    "Supervisor",
    "SupervisorGaveUp",
    "System",
    "Tick",
    "Topic",
    "background",
    "check_node",
    "check_tree",
    "every",
    "execute",
    "graph_of",
    "one_for_all",
    "one_for_one",
    "open_node",
    "parameter",
    "permanent",
    "publishes",
    "qos",
    "rest_for_one",
    "retry",
    "run",
    "spin",
    "subscribes",
    "system_of",
    "temporary",
    "transient",
]

if TYPE_CHECKING:
    __version__: str
    """The version of robactor that is installed."""


_MOVED = {
    "actors.actions": ("parallel", "queue"),
    "actors.errors": (
        "CallCycle", "Ended", "InvalidFilter", "NodeRestarting", "NotRunning", "NotStarted", "ProcessDied",
        "ProcessHung", "ProgramExit", "RemoteError", "TickMissed", "WrongThread", "WrongType",
    ),
    "actors.lifecycle": ("HookResult", "LifecycleState", "TransitionRefused", "bring_down", "bring_up"),
    "actors.running": ("remove_ros_args",),
    "actors.supervision": (
        "Failed", "Killed", "Leaked", "Returned", "Stopped", "all_significant", "any_significant", "never",
    ),
    "actors.typing": ("Clock", "ErrorVerdict", "Goal", "Outcome", "Publisher", "Rate", "Stream", "Timer"),
}  # fmt: skip
"""The module -> the names that were here and are there."""

if not TYPE_CHECKING:  # for a type checker every name would be one of this module

    def __getattr__(name: str) -> str:
        if name != "__version__":
            for module, names in _MOVED.items():
                if (
                    name in names
                ):  # an ImportError, because `from actors import name` hides the text of an AttributeError
                    raise ImportError(f"{name} is not a name of {__name__} any more: from {module} import {name}")
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from importlib.metadata import PackageNotFoundError, version  # late: nobody waits for it who does not ask

        try:
            return version("robactor")
        except PackageNotFoundError:
            raise AttributeError(
                "actors.__version__ is that of the installed robactor, and none is installed: pip install ."
            ) from None
