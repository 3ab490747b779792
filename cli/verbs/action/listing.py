"""What `action list | type | find | info` print."""

from __future__ import annotations

import argparse

from cli.command import Exit
from cli.graph.view import absolute, look
from cli.output import print_json, print_names, print_of_type, print_types


async def list_actions(options: argparse.Namespace) -> Exit:
    """The names of the actions."""
    async with look(options) as view:
        actions = view.actions()
    print_names(actions, types=options.show_types, counted=options.count_actions, json=options.json)
    return Exit.DONE


async def info(options: argparse.Namespace) -> Exit:
    """The clients and servers of one action."""
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


async def type_of(options: argparse.Namespace) -> Exit:
    """The types of one action; 1 if there are none."""
    name = absolute(options.action_name)
    async with look(options, lambda view: name in view.actions()) as view:
        types = view.actions().get(name, [])
    print_types(types, json=options.json)
    return Exit.DONE if types else Exit.FAILED


async def find(options: argparse.Namespace) -> Exit:
    """The actions of one type."""
    async with look(options) as view:
        actions = view.actions()
    print_of_type(actions, options.action_type, counted=options.count_actions, json=options.json)
    return Exit.DONE
