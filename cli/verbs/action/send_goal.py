"""`action send_goal`: one goal, followed to its end. Ctrl-C cancels it."""

from __future__ import annotations

import argparse
import asyncio
from typing import TYPE_CHECKING, Any

from actors import Action, ActionUnavailable, ActorError, GoalRejected, GoalStatus
from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.graph.seen import Seen, seen
from cli.graph.types import action_type
from cli.graph.view import absolute
from cli.output import print_json
from cli.parsing import complain
from cli.text import message_json, message_yaml
from cli.values import read_stdin, read_values
from cli.verbs.topic.pub import now

if TYPE_CHECKING:
    from actors.typing import Goal

CANCELING = 10.0
"""Seconds that a goal has to end after Ctrl-C."""

DAYS = 1e6
"""Seconds that stand for no limit."""


async def send_goal(options: argparse.Namespace) -> Exit:
    """Send a goal, and print its feedback and result."""
    name = absolute(options.action_name)
    async with seen(options) as graph:
        kind = await action_type(graph, options.action_type, lambda: uses_of(graph, name), name)
        goal_values = read_values(read_stdin() if options.stdin else options.goal, kind.Goal)
        action: Action[Any, Any, Any] = Action(kind, name)
        await _available(graph, action, options)
        message = goal_values.message(now())
        if not options.json:
            print(f"Sending goal:\n     {message_yaml(message, None)}")
        goal = graph.node.send_goal(action, message, timeout=options.timeout or DAYS)
        try:
            await goal.send()
        except GoalRejected as error:
            _say(options, "Goal was rejected.", {"event": "rejected", "reason": error.reason})
            if error.reason:
                complain(error.reason)
            return Exit.REFUSED
        except ActionUnavailable as error:
            raise CommandFailed(
                f"Timed out waiting for goal acceptance after {options.timeout} seconds: {error}"
            ) from None
        except ActorError as error:
            raise CommandFailed(f"Exception while sending goal: {error}") from None
        _say(options, f"Goal accepted with ID: {goal.goal_id.hex()}\n", {"event": "accepted", "id": goal.goal_id.hex()})
        return await _follow(goal, options)


def uses_of(graph: Seen, name: str) -> list[tuple[str, Any]]:
    """The nodes of other processes that serve an action, each with its type."""
    entry = graph.system.graph.actions.get(name)
    return [] if entry is None else [(server.host, server.type) for server in entry.remotes]


def _say(options: argparse.Namespace, text: str, event: dict[str, Any]) -> None:
    print_json(event) if options.json else print(text)


async def _available(graph: Seen, action: Action[Any, Any, Any], options: argparse.Namespace) -> None:
    if not options.json:
        print("Waiting for an action server to become available...")
    actions = graph.system.graph.actions
    if action.name not in actions or actions[action.name].server is None:
        hint = did_you_mean(action.name, [name for name, each in actions.items() if each.remotes])
        if hint:
            complain(f"nobody serves {action.name} now{hint}")
    try:
        await graph.node.wait_for(action, timeout=None if options.timeout is None else options.timeout)
    except ActionUnavailable:
        raise CommandFailed(f"Action server is not available after waiting {options.timeout} seconds.") from None


async def _follow(goal: Goal[Any, Any], options: argparse.Namespace) -> Exit:
    """Print feedback and result. A goal that succeeds is done; one that does not is refused."""
    try:
        async with asyncio.timeout(options.timeout):
            await _feedback(goal, options)
            outcome = await goal.ended()
    except TimeoutError:
        raise CommandFailed(f"Timed out waiting for result after {options.timeout} seconds.") from None
    except asyncio.CancelledError:
        await _cancel(goal, options)
        raise
    except ActorError as error:
        raise CommandFailed(f"Exception while getting result: {error}") from None
    word = outcome.status.name
    if options.json:
        result = None if outcome.result is None else message_json(outcome.result)
        print_json({"event": "ended", "status": word, "result": result, "reason": outcome.reason})
    else:
        result = "{}\n" if outcome.result is None else message_yaml(outcome.result, None)
        print(f"Result:\n    {result}")
        print(f"Goal finished with status: {word}")
    if outcome.reason and outcome.status is not GoalStatus.SUCCEEDED:
        complain(outcome.reason)
    return Exit.DONE if outcome.status is GoalStatus.SUCCEEDED else Exit.REFUSED


async def _feedback(goal: Goal[Any, Any], options: argparse.Namespace) -> None:
    async for feedback in goal:
        if options.feedback and options.json:
            print_json({"event": "feedback", "feedback": message_json(feedback)})
        elif options.feedback:
            print(f"Feedback:\n    {message_yaml(feedback, None)}")


async def _cancel(goal: Goal[Any, Any], options: argparse.Namespace) -> None:
    """Cancel the goal after Ctrl-C, and wait until it has ended."""
    if goal.done:
        return
    if not options.json:
        print("Canceling goal...")
    task = asyncio.current_task()
    assert task is not None
    task.uncancel()
    try:
        async with asyncio.timeout(options.timeout or CANCELING):
            if not await goal.cancel("Ctrl-C"):
                complain("Failed to cancel goal")
                return
            await goal.ended()
    except TimeoutError:
        complain(f"Timed out waiting for goal cancellation after {options.timeout or CANCELING:g} seconds.")
        return
    _say(options, "Goal canceled.", {"event": "canceled"})
