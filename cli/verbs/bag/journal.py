"""The journal of a node or subtree of another process, for `bag record --replay`: it is kept already, or its program is asked to begin it."""

from __future__ import annotations

import argparse
import sys

from actors import Service
from actors.interfaces.rcl_interfaces import msg, srv
from actors.replay.publishing import PUBLISHER, topic_of
from actors.replay.recording import is_subtree
from cli.command import CommandFailed
from cli.graph.asking import ask, node_names
from cli.graph.seen import Seen

GET = Service(srv.GetParameters, f"{PUBLISHER}/get_parameters")
SET = Service(srv.SetParameters, f"{PUBLISHER}/set_parameters")


async def keep_journal(graph: Seen, node: str, options: argparse.Namespace) -> None:
    """See to it that a journal of `node`, or of the subtree of this path, is kept, as far as the options allow. Raises `CommandFailed` if
    none is.

    A node or subtree that is not there yet is waited for by the recorder, like any topic.
    """
    if _is_kept(graph, node):
        return
    names = node_names(graph, hidden=True)
    unseen = PUBLISHER not in names if is_subtree(node) else node not in names
    if unseen and not options.restart:
        print(f"{node} is not there; its journal is recorded if its program keeps one", file=sys.stderr)
        return
    # A node may be seen before its journal, and before the one that keeps journals.
    found = await graph.late(
        lambda: _is_kept(graph, node) or PUBLISHER in node_names(graph, hidden=True), options.spin_time
    )
    if _is_kept(graph, node):
        return
    if not found:
        short = node if is_subtree(node) else node.rpartition("/")[2]
        raise CommandFailed(
            f"the program of {node} keeps no journals, and begins none: start it with `run --replay {short}`, or, if it is "
            "your own, with run(tree, observers=(Journal(on_request=True),))"
        )
    if not options.restart:
        raise CommandFailed(
            f"no journal of {node} is kept. A journal begins with a life of its node: with --restart the node is restarted now, in order, and "
            "loses what waits for it"
        )
    await _begin(graph, node, options)


def _is_kept(graph: Seen, node: str) -> bool:
    topic = graph.system.graph.topics.get(topic_of(node))
    return topic is not None and bool(topic.publishers)


async def _begin(graph: Seen, node: str, options: argparse.Namespace) -> None:
    got = await ask(graph, PUBLISHER, GET, srv.GetParameters.Request(names=["nodes"]), options)
    nodes = [*(name for one in got.values for name in one.string_array_value), node]
    wanted = msg.ParameterValue(type=msg.ParameterType.PARAMETER_STRING_ARRAY, string_array_value=nodes)
    request = srv.SetParameters.Request(parameters=[msg.Parameter(name="nodes", value=wanted)])
    (result,) = (await ask(graph, PUBLISHER, SET, request, options)).results
    if not result.successful:
        raise CommandFailed(result.reason)
    print(f"{node} is restarted, and its journal begins", file=sys.stderr)
