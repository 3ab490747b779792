"""`service list | type | find | info | call | echo`: the services of the graph."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from cli.command import CommandFailed, Exit
from cli.output import print_json, print_names, print_of_type, print_types
from cli.parsing import Verb, Verbs, add_common, add_json, add_style, positive_float
from cli.quality import add_qos_options

__all__ = ["main", "verbs"]


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("service", "The services of the graph.")
    listing = group.add("list", "Output a list of available services", lambda: _list)
    listing.add_argument("-t", "--show-types", action="store_true", help="with their types")
    kind = group.add("type", "Output a service's type", lambda: _type)
    kind.add_argument("service_name", help="for instance /get_battery_status")
    find = group.add("find", "Output a list of available services of a given type", lambda: _find)
    find.add_argument("service_type", help="for instance std_srvs/srv/SetBool")
    info = group.add("info", "Print information about a service", lambda: _info)
    info.add_argument("service_name", help="for instance /get_battery_status")
    info.add_argument("-v", "--verbose", action="store_true", help="with node, type hash and quality of each end")
    for parser in (listing, find):
        parser.add_argument("-c", "--count-services", action="store_true", help="only how many")
    for parser in (listing, find, kind):
        parser.add_argument(
            "--include-hidden-services", action="store_true", help="also those with a part that begins with _"
        )
    call = _call(group.add("call", "Call a service", _load_call))
    echo = group.add("echo", "Echo a service", _load_echo)
    echo.add_argument("service_name", help="for instance /get_battery_status")
    echo.add_argument("service_type", nargs="?", help="for instance std_srvs/srv/SetBool")
    add_style(echo)
    add_qos_options(echo, "subscription", "services_default")
    for parser in (listing, kind, find, info, call, echo):
        add_json(parser)
        add_common(parser)
    return group


def _call(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    parser.add_argument("service_name", help="for instance /get_battery_status")
    parser.add_argument("service_type", help="for instance std_srvs/srv/SetBool")
    values = parser.add_mutually_exclusive_group()
    values.add_argument("values", nargs="?", default="{}", help="the request in YAML, such as '{data: true}'")
    values.add_argument("--stdin", action="store_true", help="read the request from the standard input")
    parser.add_argument(
        "-r", "--rate", type=positive_float, metavar="HZ", help="call again and again, so often a second"
    )
    parser.add_argument(
        "--timeout", type=positive_float, metavar="S", help="wait at most S seconds for the service, and for an answer"
    )
    add_qos_options(parser, "client", "services_default")
    return parser


def _load_call() -> Verb:
    from cli.service_call import call

    return call


def _load_echo() -> Verb:
    from cli.service_echo import echo

    return echo


async def _list(options: argparse.Namespace) -> Exit:
    from cli.view import look

    async with look(options) as view:
        services = view.services(options.include_hidden_services)
    print_names(services, types=options.show_types, counted=options.count_services, json=options.json)
    return Exit.DONE


async def _type(options: argparse.Namespace) -> Exit:
    from cli.view import absolute, look

    name = absolute(options.service_name)
    async with look(options, lambda view: name in view.services()) as view:
        types = view.services().get(name, [])
    print_types(types, json=options.json)
    return Exit.DONE if types else Exit.FAILED


async def _find(options: argparse.Namespace) -> Exit:
    from cli.view import look

    async with look(options) as view:
        services = view.services(options.include_hidden_services)
    print_of_type(services, options.service_type, counted=options.count_services, json=options.json)
    return Exit.DONE


async def _info(options: argparse.Namespace) -> Exit:
    from cli.topic.listing import endpoint_json, endpoint_lines, unknown
    from cli.view import CLIENT, SERVER, absolute, look

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
