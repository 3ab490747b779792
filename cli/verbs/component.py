"""`component list | load | unload`: the nodes that a container loads into its process."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_graph_verb, complain
from cli.verb import Group, Verb

if TYPE_CHECKING:
    from cli.graph.seen import Seen

SERVICES = "/_container/"


def _list_arguments(parser: Parser) -> None:
    parser.add_argument("container_node_name", nargs="?", help="only of this container")
    parser.add_argument("--containers-only", action="store_true", help="only the containers")
    add_graph_verb(parser)


def _load_arguments(parser: Parser) -> None:
    parser.add_argument("container_node_name", help="for instance /ComponentManager")
    parser.add_argument("package_name", help="for instance composition")
    parser.add_argument("plugin_name", help="for instance composition::Talker, or MODULE:NODE")
    parser.add_argument("-n", "--node-name", default="", help="instead of its own name")
    parser.add_argument("--node-namespace", default="", help="instead of its own namespace")
    parser.add_argument("--log-level", default="", help="debug, info, warn, error or fatal")
    parser.add_argument("-r", "--remap-rule", action="append", default=[], metavar="OLD:=NEW")
    parser.add_argument("-p", "--parameter", action="append", default=[], metavar="NAME:=VALUE")
    parser.add_argument("-e", "--extra-argument", action="append", default=[], metavar="NAME:=VALUE")
    parser.add_argument("-q", "--quiet", action="store_true", help="print only the number of the component")
    add_graph_verb(parser)


def _unload_arguments(parser: Parser) -> None:
    parser.add_argument("container_node_name", help="for instance /ComponentManager")
    parser.add_argument("component_uid", type=int, nargs="+", help="the numbers that component list shows")
    add_graph_verb(parser)


def _containers(graph: Seen) -> list[str]:
    last = f"{SERVICES}list_nodes"
    return sorted(name.removesuffix(last) for name in graph.system.graph.services if name.endswith(last))


async def _container(graph: Seen, options: argparse.Namespace) -> str:
    from actors.suggest import did_you_mean
    from cli.graph.view import absolute

    name = options.container_node_name
    full = absolute(name)
    if not await graph.late(lambda: full in _containers(graph), options.spin_time):
        raise CommandFailed(f"Unable to find container node '{name}'{did_you_mean(full, _containers(graph))}")
    return full


async def _ask(graph: Seen, container: str, kind: Any, last: str, options: argparse.Namespace, **fields: Any) -> Any:
    from actors import Service
    from cli.graph.asking import ask

    service: Service[Any, Any] = Service(kind, f"{container}{SERVICES}{last}")
    return await ask(graph, container, service, kind.Request(**fields), options)


async def _list(options: argparse.Namespace) -> Exit:
    from actors.interfaces.composition_interfaces.srv import ListNodes
    from cli.graph.seen import seen

    found: dict[str, list[tuple[int, str]]] = {}
    async with seen(options) as graph:
        every = options.container_node_name is None
        for container in _containers(graph) if every else [await _container(graph, options)]:
            found[container] = []
            if not options.containers_only:
                answer = await _ask(graph, container, ListNodes, "list_nodes", options)
                found[container] = list(zip(answer.unique_ids.tolist(), answer.full_node_names, strict=True))
    if options.json:
        print_json({name: [{"uid": uid, "node": node} for uid, node in loaded] for name, loaded in found.items()})
        return Exit.DONE
    for container, loaded in found.items():
        if options.container_node_name is None:
            print(container)
        for uid, node in loaded:
            print(f"  {uid}  {node}")
    return Exit.DONE


async def _load(options: argparse.Namespace) -> Exit:
    from actors.interfaces.composition_interfaces.srv import LoadNode
    from actors.logs.levels import Level
    from actors.parameters.messages import to_parameter
    from actors.parameters.text import parse_parameter
    from cli.graph.seen import seen

    def parameters(rules: Sequence[str]) -> tuple[Any, ...]:
        for rule in rules:
            if ":=" not in rule:
                raise CommandFailed(f"{rule!r}: write NAME:=VALUE")
        return tuple(to_parameter(parse_parameter(*rule.split(":=", 1))) for rule in rules)

    fields = {
        "package_name": options.package_name,
        "plugin_name": options.plugin_name,
        "node_name": options.node_name,
        "node_namespace": options.node_namespace,
        "log_level": int(Level.parse(options.log_level)) if options.log_level else 0,
        "remap_rules": tuple(options.remap_rule),
        "parameters": parameters(options.parameter),
        "extra_arguments": parameters(options.extra_argument),
    }
    async with seen(options) as graph:
        container = await _container(graph, options)
        answer = await _ask(graph, container, LoadNode, "load_node", options, **fields)
    if not answer.success:
        raise CommandFailed(f"Failed to load component: {answer.error_message}")
    if options.json:
        print_json({"uid": answer.unique_id, "node": answer.full_node_name})
    elif options.quiet:
        print(answer.unique_id)
    else:
        loaded = f"Loaded component {answer.unique_id} into '{container}' container node"
        print(f"{loaded} as '{answer.full_node_name}'")
    return Exit.DONE


async def _unload(options: argparse.Namespace) -> Exit:
    from actors.interfaces.composition_interfaces.srv import UnloadNode
    from cli.graph.seen import seen

    ended, unloaded = Exit.DONE, list[int]()
    async with seen(options) as graph:
        container = await _container(graph, options)
        for uid in options.component_uid:
            answer = await _ask(graph, container, UnloadNode, "unload_node", options, unique_id=uid)
            if not answer.success:
                complain(f"Failed to unload component {uid} from '{container}' container node: {answer.error_message}")
                ended = Exit.FAILED
                continue
            unloaded.append(uid)
            if not options.json:
                print(f"Unloaded component {uid} from '{container}' container node")
    if options.json:
        print_json(unloaded)
    return ended


COMMAND = Group(
    "component",
    "The nodes that containers load.",
    Verb("list", "Output a list of running containers and components", _list_arguments, _list),
    Verb("load", "Load a component into a container node", _load_arguments, _load),
    Verb("unload", "Unload a component from a container node", _unload_arguments, _unload),
)
