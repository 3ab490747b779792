"""`launch_test FILE [NAME:=VALUE ...]`: a launch file with tests that run beside it and after its end."""

from __future__ import annotations

import argparse
from pathlib import Path
from unittest import SkipTest

from actors.launch import LaunchError, Packages
from actors.launch.testing import launch_tests
from cli.command import CommandFailed, Exit
from cli.parsing import Parser, complain
from cli.verb import Verb
from cli.verbs.launch import arguments_of


def _run(options: argparse.Namespace) -> Exit:
    """Run the tests; 1 if one fails."""
    path = Path(options.file)
    if not path.is_file():
        raise CommandFailed(f"there is no file {path}")
    arguments = arguments_of(options.arguments)
    failed = 0
    try:
        tests = launch_tests(path, packages=Packages(options.package_path))
        if options.show_args:
            print(tests[0].show_arguments())
            return Exit.DONE
        for test in tests:
            if len(tests) > 1:
                complain(f"\n{test.name}")
            try:
                outcome = test.run(arguments)
            except SkipTest as reason:
                complain(f"{test.name} is skipped: {reason}")
                continue
            for name, text in outcome.failures:
                complain(f"FAILED {test.name} {name}: {text.strip().splitlines()[-1]}")
            failed += len(outcome.failures)
    except (LaunchError, OSError) as error:
        raise CommandFailed(str(error)) from error
    return Exit.FAILED if failed else Exit.DONE


def _arguments(parser: Parser) -> None:
    add = parser.add_argument
    add("file", metavar="FILE", help="a Python file with generate_test_description()")
    add("arguments", nargs="*", metavar="NAME:=VALUE", help="arguments of the launch")
    add("-s", "--show-args", "--show-arguments", action="store_true", help="list the arguments of the launch")
    add("-v", "--verbose", action="store_true", help="accepted for launch_test's sake: the tests are always named")
    add("--package-name", metavar="NAME", help="accepted for launch_test's sake")
    add("--package-path", action="append", default=[], metavar="DIR", help="find packages in this folder, too")


COMMAND = Verb(
    "launch_test",
    "test what a launch file starts",
    _arguments,
    _run,
    description="Run a launch test: what it launches, the tests beside it, and those after its end.",
    epilog="pytest runs such a file, too, if its generate_test_description is marked with pytest.mark.launch_test.",
)
