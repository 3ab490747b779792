"""`action echo`: what goes between the clients and the servers of an action: feedback, status, and the calls of its three services."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors import Topic, qos
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.names.names import service_event_topic
from cli.command import CommandFailed, Exit
from cli.graph.looking import until_one_ends
from cli.graph.seen import Seen, seen
from cli.graph.types import action_type
from cli.graph.view import absolute
from cli.output import print_json
from cli.parsing import complain
from cli.quality import stated_qos
from cli.text import message_csv, message_json, plain, yaml_of
from cli.verbs.action.send_goal import uses_of
from cli.verbs.service.echo import named_event
from cli.verbs.topic.echo import style_of

if TYPE_CHECKING:
    from actors.qos.policies import QoS

INTERFACES: Final = ("GOAL_SERVICE", "CANCEL_SERVICE", "RESULT_SERVICE", "FEEDBACK_TOPIC", "STATUS_TOPIC")


class Interface(NamedTuple):
    """One of the five topics that an action has."""

    name: str
    topic: Topic[Any]

    @property
    def is_service(self) -> bool:
        return self.name.endswith("_SERVICE")


async def echo(options: argparse.Namespace) -> Exit:
    """Print each message as it comes, until Ctrl-C."""
    chosen = _chosen(options)
    name = absolute(options.action_name)
    async with seen(options) as graph:
        if options.action_type is None and not await graph.late(lambda: bool(uses_of(graph, name)), options.spin_time):
            raise CommandFailed(f"nobody serves {name}, so its type is not known: give it after the action")
        kind = await action_type(graph, options.action_type, lambda: uses_of(graph, name), name)
        interfaces = [one for one in _interfaces(kind, name, stated_qos(options, qos.SERVICES)) if one.name in chosen]
        for line in _silent(graph, name, interfaces):
            complain(line)
        await until_one_ends(*(_follow(graph, one, options) for one in interfaces))
    return Exit.DONE


def _chosen(options: argparse.Namespace) -> list[str]:
    """The interfaces that ``--interfaces`` names, separated by ``|``; all without any. What is a folder stays in the options, as for other verbs.

    Raises `CommandFailed` for what is neither.
    """
    names: list[str] = []
    for text in [text for text in options.interfaces if not os.path.isdir(text)]:
        options.interfaces.remove(text)
        for name in text.split("|"):
            if name.strip().upper() not in INTERFACES:
                raise CommandFailed(f'"{name.strip()}" is incorrect interface name. There are: {", ".join(INTERFACES)}')
            names.append(name.strip().upper())
    return names or [*INTERFACES]


def _interfaces(kind: Any, action: str, of_events: QoS) -> Iterator[Interface]:
    """The five of an action. Its events have the quality of service that is asked for; feedback and status have that of action clients."""
    base = f"{action}/_action/"
    for name, service, part in (
        ("GOAL_SERVICE", derived.send_goal_service(kind), "send_goal"),
        ("CANCEL_SERVICE", CancelGoal, "cancel_goal"),
        ("RESULT_SERVICE", derived.get_result_service(kind), "get_result"),
    ):
        yield Interface(name, Topic(derived.event_message(service), service_event_topic(base + part), of_events))
    yield Interface("FEEDBACK_TOPIC", Topic(derived.feedback_message(kind), f"{base}feedback", 10))
    yield Interface("STATUS_TOPIC", Topic(GoalStatusArray, f"{base}status", qos.ACTION_STATUS))


def _silent(graph: Seen, action: str, interfaces: list[Interface]) -> Iterator[str]:
    """What nobody tells of now."""
    topics = graph.system.graph.topics
    silent = [one for one in interfaces if (entry := topics.get(one.topic.name)) is None or not entry.publishers]
    if any(not one.is_service for one in silent):
        yield f"nobody serves {action} now; waiting"
    services = [one.name for one in silent if one.is_service]
    if services:
        yield f"no events of {', '.join(services)}: service introspection is not enabled at the action server or client"


async def _follow(graph: Seen, interface: Interface, options: argparse.Namespace) -> None:
    async with graph.node.subscribe(interface.topic) as messages:
        async for message in messages:
            _print(interface, message, options)


def _print(interface: Interface, message: Any, options: argparse.Namespace) -> None:
    if options.json:
        told = message_json(message)
        if interface.is_service:
            told["info"]["event_type"] = named_event(message)
        print_json({"interface": interface.name, **told})
        return
    print(f"interface: {interface.name}")
    if options.csv:
        print(message_csv(message, style_of(options)))
        return
    shown = plain(message, *style_of(options))
    if interface.is_service:
        shown["info"]["event_type"] = named_event(message)
    print(yaml_of(shown, options.flow_style) + "---")
