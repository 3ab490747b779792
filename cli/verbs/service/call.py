"""`service call`: one request, or one after the other, and the answers."""

from __future__ import annotations

import argparse
import asyncio
import math
from typing import Any

from actors import ActorError, Service, ServiceUnavailable
from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.graph.seen import Seen, seen
from cli.graph.types import service_type
from cli.graph.view import absolute
from cli.output import print_json
from cli.parsing import complain
from cli.text import message_json, message_repr
from cli.values import Values, read_stdin, read_values
from cli.verbs.topic.pub import now

SAY = 1.0
"""Seconds after which a wait for a service is spoken of, also where nothing is called like it."""
LOOK = 0.1
"""Seconds between two looks for a service that is called like it."""


async def call(options: argparse.Namespace) -> Exit:
    """Call a service, and print request and response."""
    name = absolute(options.service_name)
    async with seen(options) as graph:
        kind = await service_type(graph, options.service_type, lambda: uses_of(graph, name), name)
        values = read_values(read_stdin() if options.stdin else options.values, kind.Request)
        service: Service[Any, Any] = Service(kind, name)
        await _available(graph, service, options)
        loop = asyncio.get_running_loop()
        while True:
            started = loop.time()
            await _one(graph, service, values, options)
            if options.rate is None:
                return Exit.DONE
            await asyncio.sleep(max(0, started + 1 / options.rate - loop.time()))


def uses_of(graph: Seen, name: str) -> list[tuple[str, Any]]:
    """The nodes of other processes that serve a service, each with its type."""
    entry = graph.system.graph.services.get(name)
    return [] if entry is None else [(server.host, server.type) for server in entry.remotes]


async def _available(graph: Seen, service: Service[Any, Any], options: argparse.Namespace) -> None:
    """Wait for a server, and say so; for ever, if no limit is given."""
    entry = graph.system.graph.services.get(service.name)
    if (entry is None or entry.server is None) and not options.json:
        print("waiting for service to become available...")
    speaking = asyncio.ensure_future(_speak(graph, service.name))
    try:
        await graph.node.wait_for(service, timeout=options.timeout)
    except ServiceUnavailable as error:
        raise CommandFailed(str(error)) from None
    finally:
        speaking.cancel()


async def _speak(graph: Seen, name: str) -> None:
    """Say that nobody serves a name, with the nearest one, as soon as there is one; without one after a moment."""
    loop = asyncio.get_running_loop()
    begun = loop.time()
    told: str | None = None
    while True:
        known = [each for each, entry in graph.system.graph.services.items() if entry.remotes and each != name]
        hint = did_you_mean(name, known)
        if (hint or loop.time() >= begun + SAY) and hint != told:
            complain(f"nobody serves {name} now{hint}")
            told = hint
        await asyncio.sleep(LOOK)


async def _one(graph: Seen, service: Service[Any, Any], values: Values[Any], options: argparse.Namespace) -> None:
    request = values.message(now())
    if not options.json:
        print(f"requester: making request: {message_repr(request)}\n")
    try:
        response = await graph.node.call(service, request, timeout=options.timeout or math.inf)
    except TimeoutError as error:
        raise CommandFailed(
            f"Timed out waiting for response from service {service.name} (timeout: {options.timeout}s): {error}"
        ) from None
    except ActorError as error:
        raise CommandFailed(f"Exception while calling service: {error}") from None
    if options.json:
        print_json({"request": message_json(request), "response": message_json(response)})
    else:
        print(f"response:\n{message_repr(response)}\n")
