"""`doctor`, `doctor topic | service | node NAME`: why a graph, or a part of it, does not work, with cause, remedy and what was measured."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import asdict
from typing import TYPE_CHECKING, Final, NamedTuple

from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.output import print_json
from cli.parsing import Parser, add_graph_options, add_json, count, positive_float
from cli.verb import Verb

if TYPE_CHECKING:
    from cli.verbs.doctor.observation import Finding, Observation

WORDS: Final = ("topic", "service", "node")
LISTEN: Final = 1.0
"""For how many seconds it looks and listens."""


class Check(NamedTuple):
    """One question, and the function that answers it: with no finding if all is well."""

    title: str
    find: Callable[[Observation], Iterable[Finding]]


class Result(NamedTuple):
    """The answer to one question."""

    title: str
    findings: tuple[Finding, ...]


def _arguments(parser: Parser) -> None:
    parser.add_argument("word", nargs="?", metavar="topic | service | node", help="what to examine (everything)")
    parser.add_argument("name", nargs="?", metavar="NAME", help="for instance /cmd_vel")
    parser.add_argument("type", nargs="?", default="", metavar="TYPE", help="the type that it should have")
    parser.add_argument(
        "--seconds",
        type=positive_float,
        default=LISTEN,
        metavar="S",
        help=f"look and listen for S seconds ({LISTEN:g})",
    )
    parser.add_argument("-iw", "--include-warnings", action="store_true", help="notes count as problems, too")
    parser.add_argument("-rf", "--report-failed", action="store_true", help="print problems only")
    parser.add_argument("-r", "--report", action="store_true", help="accepted for ros2's sake: all is printed")
    add_json(parser)
    add_graph_options(parser)


async def _doctor(options: argparse.Namespace) -> Exit:
    from cli.graph.view import absolute
    from cli.verbs.doctor.observing import observe

    asked = None
    if options.word is not None:
        if options.word not in WORDS:
            hint = did_you_mean(options.word, WORDS)
            raise CommandFailed(f"doctor examines a topic, a service or a node, not {options.word!r}{hint}")
        if options.name is None:
            raise CommandFailed(f"which {options.word}? robactor {options.word} list prints them")
        asked = (options.word, absolute(options.name))
    results = everything = examined(await observe(options, asked, options.type))
    levels = ("problem", "note") if options.include_warnings else ("problem",)
    failed = any(finding.level in levels for result in results for finding in result.findings)
    if options.report_failed:
        kept = (Result(each.title, tuple(one for one in each.findings if one.level in levels)) for each in results)
        results = [result for result in kept if result.findings]
    if options.json:
        listed = [
            {"check": result.title, "findings": [asdict(finding) for finding in result.findings]} for result in results
        ]
        print_json({"healthy": not failed, "checks": listed})
    else:
        print("\n".join((*lines(results), tally(everything))))
    return Exit.REFUSED if failed else Exit.DONE


def examined(seen: Observation) -> list[Result]:
    """The answers to all questions that what was asked for raises, in the order in which one would ask them."""
    return [
        Result(check.title, tuple(check.find(seen))) for check in checks(None if seen.asked is None else seen.asked[0])
    ]


def checks(word: str | None, *, inside: bool = False) -> list[Check]:
    """The questions about everything, or about a topic, a service or a node; `inside` a system, without those about how it is reached."""
    from cli.verbs.doctor import clocks, delays, services, surroundings, topics

    of_place = [
        Check("package on the path", surroundings.packages),
        Check("transport", surroundings.transport),
        Check("security", surroundings.security),
        Check("domain", surroundings.domain),
    ]
    of_topics = [
        Check("quality of service", topics.quality),
        Check("names of topics", topics.names),
        Check("types of topics", topics.types),
    ]
    sent = [Check("data", topics.sending)]
    commands = [Check("commands are reliable", topics.best_effort_commands)]
    of_services = [
        Check("servers are running", services.serving),
        Check("types of services", services.service_types),
        Check("no client polls", services.polling),
    ]
    of_nodes = [Check("names of nodes", services.twins), Check("nodes run", delays.restarts)]
    of_time = [
        Check("queues", delays.queues),
        Check("age of messages", delays.ages),
        Check("timers", delays.timers),
        Check("event loops", delays.blocked),
        Check("simulated time", clocks.simulated_time),
        Check("clocks of machines", clocks.offsets),
    ]
    if word == "topic":
        return [*of_place, *of_topics, *sent, *commands, *of_time]
    if word == "service":
        return [*of_place, *of_services, *of_nodes, *of_time]
    there = [Check("node", services.node_is_there)] if word == "node" else [Check("processes", surroundings.processes)]
    there.append(Check("hosts", surroundings.leases))
    return [*(() if inside else of_place), *there, *of_nodes, *of_topics, *commands, *of_services, *of_time]


def lines(results: Iterable[Result]) -> Iterable[str]:
    """The report: a line for each question that has no finding, and some for each finding."""
    for title, findings in results:
        if not findings:
            yield f"ok       {title}"
        for finding in findings:
            about = title if finding.subject == title else f"{title}: {finding.subject}"
            yield f"{finding.level:<8} {about}: {finding.cause}"
            yield f"         measured: {finding.measured}"
            if finding.remedy:
                yield f"         remedy: {finding.remedy}"


def tally(results: Iterable[Result]) -> str:
    """How many problems and notes there are."""
    levels = [finding.level for result in results for finding in result.findings]
    return f"{count(levels.count('problem'), 'problem')}, {count(levels.count('note'), 'note')}"


COMMAND = Verb(
    "doctor",
    "why something does not work",
    _arguments,
    _doctor,
    description="Why a graph, or a part of it, does not work. The exit code is 1 if a problem is found.",
    usage="%(prog)s [options]\n       [topic NAME [TYPE] | service NAME [TYPE] | node NAME]",
)
