"""What `service info` prints."""

from __future__ import annotations

import argparse

from cli.command import CommandFailed, Exit
from cli.graph.view import CLIENT, SERVER, absolute, look
from cli.output import print_json
from cli.verbs.topic.listing import endpoint_json, endpoint_lines, unknown


async def info(options: argparse.Namespace) -> Exit:
    """The type and the ends of one service."""
    name = absolute(options.service_name)
    async with look(options, lambda view: name in view.services()) as view:
        types = view.services().get(name)
    if types is None:
        raise CommandFailed(unknown("service", name, view.services(hidden=False)))
    ends = {"Clients": view.endpoints(CLIENT, name=name), "Services": view.endpoints(SERVER, name=name)}
    if options.json:
        listed = {word.lower(): [endpoint_json(end) for end in found] for word, found in ends.items()}
        print_json({"name": name, "types": types, **listed})
        return Exit.DONE
    print(f"Type: {types[0] if len(types) == 1 else types}")
    for word, found in ends.items():
        print(f"{word} count: {len(found)}")
        for end in found if options.verbose else ():
            print("\n".join(endpoint_lines(end)) + "\n")
    return Exit.DONE
