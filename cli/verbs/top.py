"""`top`: hosts, processes and nodes of the running graph, and what they take, until Ctrl-C."""

from __future__ import annotations

import argparse
import asyncio
import json
import shutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from actors.names.names import is_hidden
from actors.transport.figures import FIGURES, PERIOD, ProcessFigures
from actors.typing import NodeView
from cli.graph.seen import Seen, seen
from cli.output import control
from cli.parsing import Parser, add_graph_options, count
from cli.verb import Verb

LOST = 3.5
"""After so many periods without a word a process is not shown any more."""
FIRST = 2.5
"""Seconds for which `--once` waits for the second word of each process, from which rates follow."""
NARROW = 60
WIDE = 100
"""The least and the greatest width of the table."""
FIGURES_WIDTH = 35
CLEAR = "\x1b[H\x1b[J"
"""Makes a terminal begin again at its top."""


@dataclass
class NodeRow:
    """One node; None is what its process does not tell."""

    name: str
    state: str | None = None
    incarnation: int | None = None
    restarts: int | None = None
    rate: float | None = None
    """Messages, requests and ticks that it handles a second."""
    waiting: int | None = None
    inbox_age: float | None = None
    """Seconds."""


@dataclass
class Lease:
    """One machine to which a process gives parts of its tree."""

    host: str
    left: float
    """Seconds; 0 if the machine cannot be reached."""
    parts: int
    """Of the tree, that it runs."""


@dataclass
class Process:
    """One process; None is what it does not tell."""

    process: int | None
    program: str | None = None
    cpu: float | None = None
    """Share of one core, 1.0 is all of it."""
    memory: int | None = None
    """Resident, bytes."""
    unreadable: int | None = None
    nodes: list[NodeRow] = field(default_factory=list[NodeRow])
    leases: list[Lease] = field(default_factory=list[Lease])


@dataclass
class Host:
    """One machine."""

    host: str | None
    processes: list[Process]


def _arguments(parser: Parser) -> None:
    parser.add_argument("--once", action="store_true", help="print one table and end")
    parser.add_argument("--json", action="store_true", help="a line of JSON instead of a table")
    parser.add_argument("-a", "--all", action="store_true", help="also hidden nodes, whose names begin with _")
    add_graph_options(parser)


async def _top(options: argparse.Namespace) -> int:
    live = sys.stdout.isatty() and not options.json and not options.once
    async with seen(options) as graph:
        watch = Watch(hidden=options.all)
        taking = asyncio.ensure_future(_take(graph, watch))
        try:
            await watch.settled(lambda: _others(graph), FIRST)
            while not taking.done():
                hosts = watch.hosts(_others(graph), graph.system.clock.now())
                text = _json(hosts) if options.json else "\n".join(table(hosts, shutil.get_terminal_size().columns))
                if live:
                    control(CLEAR)
                print(text, flush=True)
                if options.once:
                    return 0
                await asyncio.sleep(PERIOD)
            return await taking
        finally:
            taking.cancel()


async def _take(graph: Seen, watch: Watch) -> int:
    async with graph.node.subscribe(FIGURES) as told:
        async for figures in told:
            watch.take(figures, graph.system.clock.now())
    return 0


def _others(graph: Seen) -> list[NodeView]:
    return [node for node in graph.system.snapshot().nodes if node.name != graph.node.fqn]


class Watch:
    """What the processes have told so far.

    Invariant: of each process the last two reports are kept, until it has been silent for `LOST` periods.
    """

    def __init__(self, *, hidden: bool = False) -> None:
        """`hidden`: whether nodes are shown whose names begin with an underscore."""
        self._hidden = hidden
        self._told: dict[str, tuple[float, ProcessFigures, ProcessFigures | None]] = {}
        """By session: when, the last report, and the one before."""
        self._changed = asyncio.Event()

    def take(self, figures: ProcessFigures, now: float) -> None:
        """A process has told its figures."""
        known = self._told.get(figures.session)
        self._told[figures.session] = now, figures, None if known is None else known[1]
        self._changed.set()

    async def settled(self, nodes: Any, most: float) -> None:
        """Return when all processes of ours have told twice, or after `most` seconds. `nodes` gives the nodes of the graph."""
        try:
            async with asyncio.timeout(most):
                while True:
                    self._changed.clear()
                    twice = {one.name for _, last, before in self._told.values() if before for one in last.nodes}
                    if all(node.name in twice for node in nodes() if node.process):
                        return
                    await self._changed.wait()
        except TimeoutError:
            return

    def hosts(self, nodes: Iterable[NodeView], now: float) -> list[Host]:
        """All hosts, processes and nodes by name, those of which nobody tells at the end."""
        self._told = {session: one for session, one in self._told.items() if now - one[0] < LOST * PERIOD}
        hosts: dict[str, Host] = {}
        told: set[str] = set()
        for _, last, before in self._told.values():
            told |= {one.name for one in last.nodes}
            process = self._process(last, before)
            if process.nodes or process.leases:
                hosts.setdefault(last.host, Host(last.host, [])).processes.append(process)
        silent: dict[tuple[str, int, str], Process] = {}
        for node in nodes:
            if node.name not in told and self._is_shown(node.name):
                of = (node.host, node.process, "" if node.process else node.session)
                process = silent.setdefault(of, Process(node.process or None))
                process.nodes.append(NodeRow(node.name))
        for (host, _, _), process in silent.items():
            hosts.setdefault(host, Host(host or None, [])).processes.append(process)
        for one in hosts.values():
            one.processes.sort(key=lambda process: (process.process is None, process.process or 0))
        return [hosts[name] for name in sorted(hosts, key=lambda name: (name == "", name))]

    def _is_shown(self, name: str) -> bool:
        return self._hidden or not is_hidden(name)

    def _process(self, last: ProcessFigures, before: ProcessFigures | None) -> Process:
        seconds = 0.0 if before is None else last.at - before.at
        old = {} if before is None else {one.name: one.handled for one in before.nodes}
        rows = [
            NodeRow(
                one.name,
                one.state,
                one.incarnation,
                one.restarts,
                (one.handled - old[one.name]) / seconds if seconds > 0 and one.name in old else None,
                one.waiting,
                one.inbox_age,
            )
            for one in sorted(last.nodes, key=lambda one: one.name)
            if self._is_shown(one.name)
        ]
        leases = [Lease(one.host, one.left, one.parts) for one in last.leases]
        cpu = (last.cpu - before.cpu) / seconds if before is not None and seconds > 0 else None
        return Process(last.process, last.program, cpu, last.memory or None, last.unreadable, rows, leases)


def _json(hosts: Iterable[Host]) -> str:
    return json.dumps({"hosts": [asdict(host) for host in hosts]})


def table(hosts: Sequence[Host], columns: int) -> Iterator[str]:
    """The lines of the table, none of them wider than `columns`, if those are at least `NARROW`."""
    name = min(max(columns, NARROW), WIDE) - FIGURES_WIDTH
    processes = [process for host in hosts for process in host.processes]
    counts = f"hosts {len(hosts)}, processes {len(processes)}, nodes {sum(len(one.nodes) for one in processes)}"
    yield counts
    yield _line("", name, "CPU%", "MEM", "RATE", "AGE", "RST")
    for host in hosts:
        yield _fitted(host.host or "-", name)
        for one in host.processes:
            title = f"  {one.process or '-'} {one.program or '-'}"
            memory = None if one.memory is None else one.memory / 1e6
            yield _line(title, name, _number(one.cpu, 100, 1), _number(memory), "", "", "")
            if one.unreadable:
                yield f"    {one.unreadable} messages could not be read"
            for lease in one.leases:
                holds = f"lease {lease.left:.1f} s, {count(lease.parts, 'part')}" if lease.left else "cannot be reached"
                yield f"{_fitted(f'    host {lease.host}', name):<{name}} {holds}"
            for node in one.nodes:
                yield _line(
                    f"    {node.name}{'' if node.state in (None, 'running') else f' ({node.state})'}",
                    name,
                    "",
                    "",
                    _number(node.rate, digits=1),
                    _number(node.inbox_age, 1000, 1),
                    _number(node.restarts),
                )


def _line(title: str, width: int, cpu: str, memory: str, rate: str, age: str, restarts: str) -> str:
    return f"{_fitted(title, width):<{width}}{cpu:>6}{memory:>7}{rate:>9}{age:>8}{restarts:>5}".rstrip()


def _fitted(text: str, width: int) -> str:
    """The end of a name says more than its beginning."""
    indent = len(text) - len(text.lstrip())
    return text if len(text) <= width else text[:indent] + ".." + text[len(text) - width + indent + 2 :]


def _number(value: float | None, factor: float = 1, digits: int = 0) -> str:
    if value is None:
        return "-"
    value *= factor
    return f"{value:.{digits if value < 1000 else 0}f}"


COMMAND = Verb(
    "top",
    "hosts, processes and nodes, live",
    _arguments,
    _top,
    description="Hosts, processes and nodes, every second. CPU in percent of one core, MEM in megabytes; RATE: messages, requests "
    "and ticks handled a second; AGE: how long one has been waiting in the inbox, ms; RST: restarts. A figure that a process "
    "does not report, such as one of ROS 2, is -.",
)
