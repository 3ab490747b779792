"""Goals that a rosbridge client has sent."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

from actors import ActorError, GoalRejected, GoalStatus
from actors.contracts.contracts import Action
from actors.typing import Goal
from cli.web.clients.conversion import plain
from cli.web.clients.errors import Refused
from cli.web.clients.fields import flag, optional_number, text
from cli.web.clients.names import absolute, interface

if TYPE_CHECKING:
    from cli.web.hub import Hub
    from cli.web.rosbridge.serving import Say

PATIENCE: Final = 10.0
"""Seconds for the acceptance of a goal, if a client names no other limit."""
LONGEST: Final = 600.0


class Goals:
    """The goals of one client, by the ids that it has given them. They are canceled when it goes.

    Invariant: `_goals` holds an id from its request until its result is sent.
    """

    def __init__(self, hub: Hub, say: Say) -> None:
        self._hub = hub
        self._say = say
        self._goals: dict[str, asyncio.Future[Goal[Any, Any]]] = {}
        """Each is done once its server has accepted the goal, and canceled if that does not come."""

    async def send(self, request: dict[str, Any]) -> None:
        """Send a goal, and send its feedback and result to the client."""
        name, id = absolute(text(request, "action")), str(request.get("id"))
        told = {"id": id, "action": text(request, "action")}
        try:
            await self._follow(name, id, told, request)
        except GoalRejected as error:
            why = f"Action goal was rejected{f': {error.reason}' if error.reason else ''}"
            self._say("action_result", **told, values=why, status=GoalStatus.UNKNOWN.value, result=False)
        except (ActorError, Refused) as error:
            self._say("action_result", **told, values=str(error), status=GoalStatus.UNKNOWN.value, result=False)

    async def cancel(self, request: dict[str, Any]) -> None:
        """Ask for the end of a goal, as soon as it is accepted. Raises `Refused` if it does not run, or must not be canceled."""
        id = str(request.get("id"))
        accepted = self._goals.get(id)
        if accepted is None:
            raise Refused(f"no goal {id:.60} runs")
        await asyncio.wait([accepted])
        if accepted.cancelled():
            raise Refused(f"goal {id:.60} was not accepted")
        goal = accepted.result()
        try:
            if not await goal.cancel("canceled by the web client"):
                raise Refused(f"goal {id:.60} has ended, or its server does not let it be canceled")
        except ActorError as error:
            raise Refused(str(error)) from None

    async def _follow(self, name: str, id: str, told: dict[str, Any], request: dict[str, Any]) -> None:
        if id in self._goals:
            raise Refused(f"goal {id:.60} runs already: give the new one another id")
        accepted = self._goals[id] = asyncio.get_running_loop().create_future()
        try:
            goal = await self._made(name, request)
            async with goal:
                accepted.set_result(goal)
                async for feedback in goal:
                    if flag(request, "feedback"):
                        self._say("action_feedback", **told, values=plain(feedback))
                outcome = await goal.ended()
        finally:
            accepted.cancel()
            del self._goals[id]
        values = outcome.reason if outcome.result is None else plain(outcome.result)
        status = outcome.status.value
        self._say("action_result", **told, values=values, status=status, result=outcome.result is not None)

    async def _made(self, name: str, request: dict[str, Any]) -> Goal[Any, Any]:
        named = text(request, "action_type", "")
        kind = await self._hub.types.action(name, interface(named, "action") if named else "")
        stamp = self._hub.system.clock.stamp()
        message = await self._hub.conversions.message(kind.Goal, request.get("args"), stamp)
        patience = min(optional_number(request, "timeout") or PATIENCE, LONGEST)
        return self._hub.node.send_goal(Action(kind, name), message, timeout=patience)
