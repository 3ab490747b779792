"""`service echo`: requests and responses of a service, as far as its ends tell of them (service introspection)."""

from __future__ import annotations

import argparse
from typing import Any

from actors import Topic, qos
from actors.interfaces.derived import event_message
from actors.interfaces.service_msgs.msg import ServiceEventInfo
from actors.names.names import service_event_topic
from cli.command import CommandFailed, Exit
from cli.graph.seen import seen
from cli.graph.types import service_type
from cli.graph.view import absolute
from cli.output import print_json
from cli.parsing import complain
from cli.quality import stated_qos
from cli.text import message_csv, message_json, plain, yaml_of
from cli.verbs.service.call import uses_of
from cli.verbs.topic.echo import style_of

_EVENTS = {constant.value: constant.name for constant in ServiceEventInfo.__ros_constants__}


async def echo(options: argparse.Namespace) -> Exit:
    """Print the events of a service until Ctrl-C."""
    name = absolute(options.service_name)
    async with seen(options) as graph:
        if options.service_type is None and not await graph.late(lambda: bool(uses_of(graph, name)), options.spin_time):
            raise CommandFailed(f"nobody serves {name}, so its type is not known: give it after the service")
        kind: Any = await service_type(graph, options.service_type, lambda: uses_of(graph, name), name)
        events = service_event_topic(name)
        known = graph.system.graph.topics.get(events)
        if known is None or not known.publishers:
            complain(f"No publishers on topic '{events}'; is service introspection on the client or server enabled?")
        topic = Topic(event_message(kind), events, stated_qos(options, qos.SERVICES))
        async with graph.node.subscribe(topic) as messages:
            async for message in messages:
                _print(message, options)
    return Exit.DONE


def named_event(message: Any) -> str:
    """The name of the step of a call that an event message tells of, such as ``REQUEST_SENT``."""
    return _EVENTS.get(message.info.event_type, str(message.info.event_type))


def _print(message: Any, options: argparse.Namespace) -> None:
    event = named_event(message)
    if options.json:
        print_json({"event": event, **message_json(message)})
        return
    if options.csv:
        print(message_csv(message, style_of(options)))
        return
    shown = plain(message, *style_of(options))
    shown["info"]["event_type"] = event
    print(yaml_of(shown, options.flow_style) + "---")
