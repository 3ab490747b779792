"""The state machine of a lifecycle node: four primary states, seven requests, six hooks, by the rules of ROS 2.

The machine is pure: it names the hook to run, and its owner runs (or awaits) the hook and gives the result back.

    hook = machine.begin("configure")             # TransitionRefused if that is not possible now
    while hook is not None:
        hook = machine.finish(await run(hook))    # at most one more: on_error

States, transitions and their numbers are those of `lifecycle_msgs`; the graph is that of rcl_lifecycle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Final

import msgspec

from actors.errors import ActorError


class LifecycleState(IntEnum):
    """The states, numbered as in `lifecycle_msgs/msg/State`. Those from 10 on are transition states, in which a hook runs."""

    UNKNOWN = 0
    UNCONFIGURED = 1
    INACTIVE = 2
    ACTIVE = 3
    FINALIZED = 4
    CONFIGURING = 10
    CLEANINGUP = 11
    SHUTTINGDOWN = 12
    ACTIVATING = 13
    DEACTIVATING = 14
    ERRORPROCESSING = 15

    @property
    def label(self) -> str:
        """The name of the state in messages and tools."""
        return self.name.lower()

    @property
    def is_primary(self) -> bool:
        """True for a state in which the node can stay, False for one in which a hook runs."""
        return self < LifecycleState.CONFIGURING


STATES: Final = tuple(LifecycleState)
"""All eleven states in order of their numbers: the answer to get_available_states."""


class HookResult(IntEnum):
    """The result of a hook, numbered as the TRANSITION_CALLBACK constants of `lifecycle_msgs/msg/Transition`.

    FAILURE leads back to the state in which the transition began (after a failed shutdown the node is finalized all the
    same); ERROR leads to error processing, where on_error runs.
    """

    SUCCESS = 97
    FAILURE = 98
    ERROR = 99


class LifecycleTransition(msgspec.Struct, frozen=True):
    """One edge of the state graph. Those with ids below 10 can be requested, the others follow from results of hooks."""

    id: int
    label: str
    start: LifecycleState
    goal: LifecycleState

    @property
    def is_request(self) -> bool:
        """True for the seven transitions that can be requested."""
        return self.id < 10


def _graph() -> tuple[LifecycleTransition, ...]:
    state = LifecycleState
    # id, label, start, the state in which the hook runs, the states after its success and its failure; errors are alike for all.
    requests = (
        (1, "configure", state.UNCONFIGURED, state.CONFIGURING, state.INACTIVE, state.UNCONFIGURED),
        (2, "cleanup", state.INACTIVE, state.CLEANINGUP, state.UNCONFIGURED, state.INACTIVE),
        (3, "activate", state.INACTIVE, state.ACTIVATING, state.ACTIVE, state.INACTIVE),
        (4, "deactivate", state.ACTIVE, state.DEACTIVATING, state.INACTIVE, state.ACTIVE),
        (5, "shutdown", state.UNCONFIGURED, state.SHUTTINGDOWN, state.FINALIZED, state.FINALIZED),
    )
    edges: list[LifecycleTransition] = []
    for number, label, start, via, success, failure in requests:
        edges += [
            LifecycleTransition(number, label, start, via),
            LifecycleTransition(number * 10, "transition_success", via, success),
            LifecycleTransition(number * 10 + 1, "transition_failure", via, failure),
            LifecycleTransition(number * 10 + 2, "transition_error", via, state.ERRORPROCESSING),
        ]
    edges += [
        LifecycleTransition(6, "shutdown", state.INACTIVE, state.SHUTTINGDOWN),
        LifecycleTransition(7, "shutdown", state.ACTIVE, state.SHUTTINGDOWN),
        LifecycleTransition(60, "transition_success", state.ERRORPROCESSING, state.UNCONFIGURED),
        LifecycleTransition(61, "transition_failure", state.ERRORPROCESSING, state.FINALIZED),
        LifecycleTransition(62, "transition_error", state.ERRORPROCESSING, state.FINALIZED),
    ]
    return tuple(sorted(edges, key=lambda edge: edge.id))


TRANSITIONS: Final = _graph()
"""All 25 transitions in order of their ids: the answer to get_transition_graph."""

_FROM: Final[Mapping[LifecycleState, tuple[LifecycleTransition, ...]]] = {
    state: tuple(edge for edge in TRANSITIONS if edge.start is state) for state in STATES
}


def transitions_from(state: LifecycleState) -> tuple[LifecycleTransition, ...]:
    """The transitions that leave a state, in order of their ids; for a state in which a hook runs, those of its results."""
    return _FROM[state]


_REQUESTS: Final[Mapping[int | str, str]] = {edge.id: edge.label for edge in TRANSITIONS if edge.is_request}
_HOOK_IN: Final[Mapping[LifecycleState, str]] = {
    LifecycleState.CONFIGURING: "on_configure",
    LifecycleState.CLEANINGUP: "on_cleanup",
    LifecycleState.SHUTTINGDOWN: "on_shutdown",
    LifecycleState.ACTIVATING: "on_activate",
    LifecycleState.DEACTIVATING: "on_deactivate",
    LifecycleState.ERRORPROCESSING: "on_error",
}
_LABEL_OF: Final[Mapping[HookResult, str]] = {
    HookResult.SUCCESS: "transition_success",
    HookResult.FAILURE: "transition_failure",
    HookResult.ERROR: "transition_error",
}


class LifecycleHook(msgspec.Struct, frozen=True):
    """The hook to run next: the name of its method, and the primary state from which the node comes."""

    name: str
    previous: LifecycleState


class TransitionRefused(ActorError):
    """A transition that is unknown, not possible in the present state, or requested while another one runs.

    The state is unchanged and no event was sent. `state` is that state, `asked` the requested label or id.
    """

    def __init__(self, state: LifecycleState, asked: int | str) -> None:
        if state.is_primary:
            possible = ", ".join(edge.label for edge in _FROM[state]) or "none: it is the end"
            why = f"possible from there: {possible}"
        else:
            why = "a transition is under way: wait for it to end"
        named = f" ({_REQUESTS[asked]})" if asked in _REQUESTS else ""
        super().__init__(f"the transition {asked!r}{named} is refused: the node is {state.label}; {why}")
        self.state = state
        self.asked = asked


class LifecycleMachine:
    """The lifecycle of one node, unconfigured at first. `on_transition` is called with every transition, after the state has changed.

    Invariants:

    - `state` changes only along an edge of the graph.
    - `succeeded` says whether the hook of the last request returned SUCCESS: the answer to change_state.
    - `_came_from` is the primary state in which the last request was made.
    """

    __slots__ = ("_came_from", "failure", "on_transition", "state", "succeeded")

    def __init__(
        self,
        state: LifecycleState = LifecycleState.UNCONFIGURED,
        on_transition: Callable[[LifecycleTransition], None] | None = None,
    ) -> None:
        self.state = state
        self.on_transition = on_transition
        self.succeeded = False
        self.failure: Exception | None = None
        self._came_from = state

    def __repr__(self) -> str:
        return f"<lifecycle: {self.state.label}>"

    @property
    def publishes(self) -> bool:
        """Whether lifecycle publishers deliver: in ACTIVE, and until the hook of the transition that leaves it has returned.

        So a node may publish final messages (zero velocity, say) in on_deactivate and on_shutdown. After that hook, and
        in on_error, publishers do not deliver unless the node is ACTIVE again.
        """
        if self.state is LifecycleState.ACTIVE:
            return True
        leaving = self.state in (LifecycleState.DEACTIVATING, LifecycleState.SHUTTINGDOWN)
        return leaving and self._came_from is LifecycleState.ACTIVE

    def available(self) -> tuple[LifecycleTransition, ...]:
        """The transitions that leave the present state, in order of their ids; while a hook runs, those of its results."""
        return _FROM[self.state]

    def lookup(self, label: str) -> LifecycleTransition | None:
        """The transition with this label that leaves the present state (`shutdown` has three ids), or None."""
        return next((edge for edge in _FROM[self.state] if edge.label == label), None)

    def fire(self, transition_id: int) -> LifecycleTransition:
        """Take one edge of the graph, without hooks. Raises TransitionRefused if it does not leave the present state."""
        edge = next((edge for edge in _FROM[self.state] if edge.id == transition_id), None)
        if edge is None:
            raise TransitionRefused(self.state, transition_id)
        self._take(edge)
        return edge

    def begin(self, label: str = "", transition_id: int = 0) -> LifecycleHook:
        """Begin the requested transition and return the hook to run. A label, if given, counts more than the id.

        Raises TransitionRefused unless it is one of the seven requests, leaves the present state, and no hook runs.
        """
        asked: int | str = label or transition_id
        edge = next(
            (edge for edge in _FROM[self.state] if edge.is_request and asked == (edge.label if label else edge.id)),
            None,
        )
        if edge is None:
            raise TransitionRefused(self.state, asked)
        self._came_from = self.state
        self.succeeded = False
        self._take(edge)
        return self._hook()

    def finish(self, result: HookResult) -> LifecycleHook | None:
        """Take the result of the hook that has run. Returns the hook to run next (on_error), or None at the end.

        The owner passes ERROR for a hook that raised or returned anything else, and reports that.
        Raises TransitionRefused if no hook was running.
        """
        label = _LABEL_OF[result]
        if self.state.is_primary:
            raise TransitionRefused(self.state, label)
        edge = next(edge for edge in _FROM[self.state] if edge.label == label)
        if self.state is not LifecycleState.ERRORPROCESSING:
            self.succeeded = result is HookResult.SUCCESS
        self._take(edge)
        return None if self.state.is_primary else self._hook()

    def change(self, run: Callable[[LifecycleHook], HookResult], label: str = "", transition_id: int = 0) -> bool:
        """Make a whole transition at once, with hooks that do not wait. Returns the answer to change_state.

        That is False also for a refused request. A hook that raises counts as ERROR; `failure` keeps the exception.
        """
        self.failure = None
        try:
            hook: LifecycleHook | None = self.begin(label, transition_id)
        except TransitionRefused:
            return False
        while hook is not None:
            try:
                result = run(hook)
            except Exception as error:
                self.failure = error
                result = HookResult.ERROR
            hook = self.finish(result)
        return self.succeeded

    def _hook(self) -> LifecycleHook:
        return LifecycleHook(_HOOK_IN[self.state], self._came_from)

    def _take(self, edge: LifecycleTransition) -> None:
        self.state = edge.goal
        if self.on_transition is not None:
            self.on_transition(edge)
