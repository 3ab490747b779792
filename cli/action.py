"""`action list | info | type | find | send_goal | echo`: the actions of the graph."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from cli.command import Exit
from cli.output import print_json, print_names, print_of_type, print_types
from cli.parsing import Verb, Verbs, add_common, add_json, add_style, natural
from cli.quality import add_qos_options

__all__ = ["main", "verbs"]


def main(argv: Sequence[str]) -> int | Exit:
    """Run one verb of the group."""
    return verbs().run(argv)


def verbs() -> Verbs:
    """The verbs of the group."""
    group = Verbs("action", "The actions of the graph.")
    listing = group.add("list", "Output a list of action names", lambda: _list)
    listing.add_argument("-t", "--show-types", action="store_true", help="with their types")
    info = group.add("info", "Print information about an action", lambda: _info)
    info.add_argument("action_name", help="for instance /move_to_position")
    info.add_argument("-t", "--show-types", action="store_true", help="with their types")
    info.add_argument("-c", "--count", action="store_true", help="only how many clients and servers")
    kind = group.add("type", "Print a action's type", lambda: _type)
    kind.add_argument("action_name", help="for instance /move_to_position")
    find = group.add("find", "Find actions from type", lambda: _find)
    find.add_argument("action_type", help="for instance example_interfaces/action/Fibonacci")
    for parser in (listing, find):
        parser.add_argument("-c", "--count-actions", action="store_true", help="only how many")
    send = group.add("send_goal", "Send an action goal", _load_send_goal)
    send.add_argument("action_name", help="for instance /move_to_position")
    send.add_argument("action_type", help="for instance example_interfaces/action/Fibonacci")
    values = send.add_mutually_exclusive_group()
    values.add_argument("goal", nargs="?", default="{}", help="the goal in YAML, such as '{order: 5}'")
    values.add_argument("--stdin", action="store_true", help="read the goal from the standard input")
    send.add_argument("-f", "--feedback", action="store_true", help="print feedback")
    send.add_argument(
        "-t",
        "--timeout",
        type=natural,
        metavar="S",
        help="wait at most S seconds for each of server, answer and result",
    )
    echo = _echo(group.add("echo", "Echo a action", _load_echo))
    for parser in (listing, info, kind, find, send, echo):
        add_json(parser)
        add_common(parser)
    return group


def _echo(parser: argparse.ArgumentParser) -> argparse.ArgumentParser:
    parser.add_argument("action_name", help="for instance /move_to_position")
    parser.add_argument("action_type", nargs="?", help="for instance example_interfaces/action/Fibonacci")
    parser.add_argument(
        "-i",
        action="append",
        dest="interfaces",
        default=[],
        metavar="NAMES",
        help="only these, separated by |: GOAL_SERVICE, CANCEL_SERVICE, RESULT_SERVICE, FEEDBACK_TOPIC, STATUS_TOPIC; also as --interfaces",
    )
    add_style(parser)
    add_qos_options(parser, "subscription to events", "services_default")
    return parser


def _load_echo() -> Verb:
    from cli.action_echo import echo

    return echo


def _load_send_goal() -> Verb:
    from cli.action_goal import send_goal

    return send_goal


async def _list(options: argparse.Namespace) -> Exit:
    from cli.view import look

    async with look(options) as view:
        actions = view.actions()
    print_names(actions, types=options.show_types, counted=options.count_actions, json=options.json)
    return Exit.DONE


async def _info(options: argparse.Namespace) -> Exit:
    from cli.view import absolute, look

    name = absolute(options.action_name)
    async with look(options, lambda view: any(view.action_nodes(name))) as view:
        clients, servers = view.action_nodes(name)
    ends = {
        word: [(end.node, end.about.type.removesuffix("_FeedbackMessage")) for end in found]
        for word, found in (("clients", clients), ("servers", servers))
    }
    if options.json:
        listed = {word: [{"node": node, "type": kind} for node, kind in found] for word, found in ends.items()}
        print_json({"name": name, **listed})
        return Exit.DONE
    print(f"Action: {name}")
    for word, found in ends.items():
        print(f"Action {word}: {len(found)}")
        for node, kind in () if options.count else found:
            print(f"    {node} [{kind}]" if options.show_types else f"    {node}")
    return Exit.DONE


async def _type(options: argparse.Namespace) -> Exit:
    from cli.view import absolute, look

    name = absolute(options.action_name)
    async with look(options, lambda view: name in view.actions()) as view:
        types = view.actions().get(name, [])
    print_types(types, json=options.json)
    return Exit.DONE if types else Exit.FAILED


async def _find(options: argparse.Namespace) -> Exit:
    from cli.view import look

    async with look(options) as view:
        actions = view.actions()
    print_of_type(actions, options.action_type, counted=options.count_actions, json=options.json)
    return Exit.DONE
