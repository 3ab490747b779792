"""`lifecycle nodes | list | get | set`: managed nodes and their states."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_graph_verb, complain, positive_float
from cli.verb import Group, Verb

if TYPE_CHECKING:
    from cli.graph.seen import Seen

CHANGE_STATE = "/change_state"


def _nodes_arguments(parser: Parser) -> None:
    parser.add_argument("-a", "--all", action="store_true", help="also hidden ones, whose names begin with _")
    parser.add_argument("-c", "--count-nodes", action="store_true", help="only how many")
    add_graph_verb(parser)


def _list_arguments(parser: Parser) -> None:
    parser.add_argument("node_name", help="for instance /camera")
    parser.add_argument("-a", "--all", action="store_true", help="also those that are not possible now")
    _of_node(parser)


def _get_arguments(parser: Parser) -> None:
    parser.add_argument("node_name", nargs="?", help="for instance /camera; without it, of all managed nodes")
    _of_node(parser)


def _set_arguments(parser: Parser) -> None:
    parser.add_argument("node_name", help="for instance /camera")
    parser.add_argument("transition", help="its label, such as configure, or its number")
    _of_node(parser)


def _of_node(parser: Parser) -> None:
    parser.add_argument("--include-hidden-nodes", action="store_true", help="also nodes whose names begin with _")
    parser.add_argument(
        "--timeout", type=positive_float, dest="service_timeout", metavar="S", help="wait S seconds for an answer"
    )
    add_graph_verb(parser)


async def _nodes(options: argparse.Namespace) -> Exit:
    from cli.graph.view import look

    async with look(options) as view:
        names = [name.removesuffix(CHANGE_STATE) for name in view.services() if name.endswith(CHANGE_STATE)]
        names = [name for name in names if name in view.nodes(options.all)]
    if options.count_nodes:
        print(len(names))
    elif options.json:
        print_json(names)
    else:
        for name in names:
            print(name)
    return Exit.DONE


async def _ask(graph: Seen, node: str, kind: Any, last: str, options: argparse.Namespace, **fields: Any) -> Any:
    from actors import Service
    from cli.graph.asking import ask

    name = f"{node}/{last}"
    if not await graph.late(lambda: name in graph.system.graph.services, options.spin_time):
        raise CommandFailed(f"{node} is no managed node: it has no service {name}")
    service: Service[Any, Any] = Service(kind, name)
    return await ask(graph, node, service, kind.Request(**fields), options)


async def _get(options: argparse.Namespace) -> Exit:
    from actors.interfaces.lifecycle_msgs.srv import GetState
    from cli.graph.asking import found_node
    from cli.graph.seen import seen

    states: dict[str, Any] = {}
    async with seen(options) as graph:
        if options.node_name is not None:
            nodes = [await found_node(graph, options.node_name)]
        else:
            served = graph.system.graph.services
            nodes = sorted(name.removesuffix(CHANGE_STATE) for name in served if name.endswith(CHANGE_STATE))
        for node in nodes:
            states[node] = (await _ask(graph, node, GetState, "get_state", options)).current_state
    if options.json:
        print_json({node: {"label": state.label, "id": state.id} for node, state in states.items()})
        return Exit.DONE
    for node, state in states.items():
        print(f"{'' if options.node_name else f'{node}: '}{state.label} [{state.id}]")
    return Exit.DONE


async def _transitions(graph: Seen, node: str, options: argparse.Namespace, *, every: bool) -> Sequence[Any]:
    from actors.interfaces.lifecycle_msgs.srv import GetAvailableTransitions

    last = "get_transition_graph" if every else "get_available_transitions"
    answer = await _ask(graph, node, GetAvailableTransitions, last, options)
    transitions: Sequence[Any] = answer.available_transitions
    return transitions


async def _list(options: argparse.Namespace) -> Exit:
    from actors.interfaces import to_plain
    from cli.graph.asking import found_node
    from cli.graph.seen import seen

    async with seen(options) as graph:
        node = await found_node(graph, options.node_name)
        transitions = await _transitions(graph, node, options, every=options.all)
    if options.json:
        print_json([to_plain(each) for each in transitions])
        return Exit.DONE
    for each in transitions:
        print(f"- {each.transition.label} [{each.transition.id}]")
        print(f"\tStart: {each.start_state.label}\n\tGoal: {each.goal_state.label}")
    return Exit.DONE


async def _set(options: argparse.Namespace) -> Exit:
    from actors.interfaces.lifecycle_msgs.srv import ChangeState
    from cli.graph.asking import found_node
    from cli.graph.seen import seen

    async with seen(options) as graph:
        node = await found_node(graph, options.node_name)
        known = [each.transition for each in await _transitions(graph, node, options, every=False)]
        by_word = {str(each.id): each for each in known} | {each.label: each for each in known}
        wanted = by_word.get(options.transition)
        if wanted is None:
            lines = "".join(f"\n- {each.label} [{each.id}]" for each in known)
            raise CommandFailed(f"Unknown transition requested, available ones are:{lines}")
        answer = await _ask(graph, node, ChangeState, "change_state", options, transition=wanted)
    if options.json:
        print_json({"successful": answer.success})
    elif answer.success:
        print("Transitioning successful")
    else:
        complain("Transitioning failed")
    return Exit.DONE if answer.success else Exit.REFUSED


COMMAND = Group(
    "lifecycle",
    "Managed nodes, and their states.",
    Verb("nodes", "Output a list of nodes with lifecycle", _nodes_arguments, _nodes),
    Verb("list", "Output a list of available transitions", _list_arguments, _list),
    Verb("get", "Get lifecycle state for one or more nodes", _get_arguments, _get),
    Verb("set", "Trigger lifecycle state transition", _set_arguments, _set),
)
