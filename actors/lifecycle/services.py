"""The services and messages of ``lifecycle_msgs``, for one lifecycle node."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

from actors.lifecycle.machine import (
    STATES,
    TRANSITIONS,
    LifecycleState,
    LifecycleTransition,
    TransitionRefused,
    transitions_from,
)

if TYPE_CHECKING:
    from actors.interfaces.lifecycle_msgs import msg, srv
    from actors.lifecycle.node import LifecycleNode
    from actors.services.peers import Served


def _state(state: LifecycleState) -> msg.State:
    from actors.interfaces.lifecycle_msgs.msg import State

    return State(id=int(state), label=state.label)


def _transition(edge: LifecycleTransition) -> msg.Transition:
    from actors.interfaces.lifecycle_msgs.msg import Transition

    return Transition(id=edge.id, label=edge.label)


def transition_event(edge: LifecycleTransition) -> msg.TransitionEvent:
    """The `TransitionEvent` of one step of the machine."""
    from actors.interfaces.lifecycle_msgs.msg import TransitionEvent

    return TransitionEvent(transition=_transition(edge), start_state=_state(edge.start), goal_state=_state(edge.goal))


def _described(edges: Sequence[LifecycleTransition]) -> tuple[msg.TransitionDescription, ...]:
    from actors.interfaces.lifecycle_msgs.msg import TransitionDescription

    return tuple(
        TransitionDescription(
            transition=_transition(edge), start_state=_state(edge.start), goal_state=_state(edge.goal)
        )
        for edge in edges
    )


def _change_state(node: LifecycleNode) -> Served:
    from actors.interfaces.lifecycle_msgs.srv import ChangeState

    async def change_state(request: srv.ChangeState.Request) -> srv.ChangeState.Response:
        try:
            return ChangeState.Response(
                success=await node.change_state(request.transition.label, request.transition.id)
            )
        except TransitionRefused as refusal:
            node.log.warning(str(refusal))
            return ChangeState.Response(success=False)

    return ChangeState, change_state


def _get_state(node: LifecycleNode) -> Served:
    from actors.interfaces.lifecycle_msgs.srv import GetState

    async def get_state(request: srv.GetState.Request) -> srv.GetState.Response:
        return GetState.Response(current_state=_state(node.state))

    return GetState, get_state


def _get_available_states(node: LifecycleNode) -> Served:
    from actors.interfaces.lifecycle_msgs.srv import GetAvailableStates

    async def get_available_states(request: srv.GetAvailableStates.Request) -> srv.GetAvailableStates.Response:
        return GetAvailableStates.Response(available_states=tuple(_state(state) for state in STATES))

    return GetAvailableStates, get_available_states


def _get_available_transitions(node: LifecycleNode) -> Served:
    from actors.interfaces.lifecycle_msgs.srv import GetAvailableTransitions

    async def get_available_transitions(
        request: srv.GetAvailableTransitions.Request,
    ) -> srv.GetAvailableTransitions.Response:
        return GetAvailableTransitions.Response(available_transitions=_described(transitions_from(node.state)))

    return GetAvailableTransitions, get_available_transitions


def _get_transition_graph(node: LifecycleNode) -> Served:
    from actors.interfaces.lifecycle_msgs.srv import GetAvailableTransitions

    async def get_transition_graph(
        request: srv.GetAvailableTransitions.Request,
    ) -> srv.GetAvailableTransitions.Response:
        return GetAvailableTransitions.Response(available_transitions=_described(TRANSITIONS))

    return GetAvailableTransitions, get_transition_graph


SERVICES: Final[dict[str, Callable[[LifecycleNode], Served]]] = {
    "change_state": _change_state,
    "get_state": _get_state,
    "get_available_states": _get_available_states,
    "get_available_transitions": _get_available_transitions,
    "get_transition_graph": _get_transition_graph,
}
"""Name below the node -> type and handler."""
