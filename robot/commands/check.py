"""`check`: whether this machine, and a map, are good enough to run the robot, in half a minute."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from cli.command import Exit
from cli.output import print_json
from cli.parsing import Parser, add_json
from cli.verb import Verb


def _arguments(parser: Parser) -> None:
    parser.add_argument("--map", type=Path, metavar="FILE", help="also this map, a YAML file of map_server's")
    add_json(parser)


def _run(options: argparse.Namespace) -> Exit:
    from cli.verbs.doctor import Result, lines, tally
    from robot.commands import checks

    asked = [
        ("physics", checks.engine),
        ("speed", checks.speed),
        ("punctuality", checks.punctuality),
        ("memory, disk and port", checks.room),
        ("network", checks.network),
    ]
    if options.map is not None:
        asked.append((f"map {options.map}", checks.map_file(options.map)))
    results: list[Result] = []
    for title, find in asked:
        results.append(Result(title, tuple(find())))
        if not options.json:
            print("\n".join(lines(results[-1:])), flush=True)
        if results[-1].findings and find is checks.engine:
            break  # without the physics there is nothing to be measured
    if options.json:
        print_json([{"check": one.title, "findings": [asdict(each) for each in one.findings]} for one in results])
    else:
        print(tally(results))
    bad = any(finding.level == "problem" for result in results for finding in result.findings)
    return Exit.FAILED if bad else Exit.DONE


COMMAND = Verb(
    "check",
    "whether this machine and a map are good enough",
    _arguments,
    _run,
    description="Measure this machine, and look at a map: is it good enough for the robot? Each problem comes with a remedy.",
)
