"""The shape of the command line: a `Verb` has a name, a line of help, its arguments and a function that carries it out; a `Group` has verbs.

Another package adds a command by an entry point of the group ``robactor.verbs`` whose object is a `Verb` or a `Group`.
"""

from __future__ import annotations

import argparse
import os
import signal
import threading
from collections.abc import Callable, Coroutine, Sequence
from importlib import import_module
from typing import Any, TypeAlias, cast

from cli.command import Exit, UsageError
from cli.parsing import Parser, outline

PROGRAM = "robactor"

Run: TypeAlias = Callable[[argparse.Namespace], "Coroutine[Any, Any, int | Exit] | int | Exit"]
"""Carries out a verb with its options: a function, or a coroutine function, which is canceled at a signal."""


class Verb:
    """One verb.

    `arguments` adds to the parser what may follow the verb. `run` is a `Run`, or where it is, ``"package.module:function"``: it is imported
    when the verb is carried out, so that neither help nor completion waits for it. `parse` takes the place of the parser's own reading of
    the words, for a verb whose words are another program's.
    """

    def __init__(
        self,
        name: str,
        help: str,
        arguments: Callable[[Parser], object],
        run: Run | str,
        *,
        description: str | None = None,
        usage: str | None = None,
        epilog: str | None = None,
        parse: Callable[[Parser, Sequence[str]], argparse.Namespace] | None = None,
    ) -> None:
        self.name = name
        self.help = help
        self._arguments = arguments
        self._run = run
        self._description = description or help
        self._usage = usage
        self._epilog = epilog
        self._parse = parse

    def parser(self, before: str = PROGRAM) -> Parser:
        """Its parser; `before` is what stands before its name on the command line."""
        parser = Parser(prog=f"{before} {self.name}", description=self._description, epilog=self._epilog)
        self._arguments(parser)
        parser.usage = self._usage or outline(parser)
        return parser

    def main(self, argv: Sequence[str], before: str = PROGRAM) -> int | Exit:
        """Carry it out with these words. Raises `UsageError` for words that it does not understand."""
        parser = self.parser(before)
        try:
            options = self._parse(parser, argv) if self._parse is not None else parser.parse_args(list(argv))
        except UsageError as error:
            raise UsageError(f"{parser.prog}: {error}") from None
        return carried_out(self.loaded(), options)

    def loaded(self) -> Run:
        """The function that carries it out."""
        if not isinstance(self._run, str):
            return self._run
        module, _, function = self._run.partition(":")
        return cast("Run", getattr(import_module(module), function))


class Group:
    """Verbs that belong together, such as those of topics."""

    def __init__(self, name: str, help: str, *verbs: Verb) -> None:
        self.name = name
        self.help = help
        self.verbs = {verb.name: verb for verb in verbs}

    def parser(self) -> Parser:
        """A parser with its help."""
        parser = Parser(prog=f"{PROGRAM} {self.name}", description=self.help)
        verbs = parser.add_subparsers(metavar="VERB")
        for verb in self.verbs.values():
            verbs.add_parser(verb.name, help=verb.help)
        return parser

    def main(self, argv: Sequence[str]) -> int | Exit:
        """Carry out the verb that the first word names; without one, print the help. Raises `UsageError`."""
        prog = f"{PROGRAM} {self.name}"
        if not argv or argv[0] in ("-h", "--help"):
            self.parser().print_help()
            return Exit.DONE
        verb = self.verbs.get(argv[0])
        if verb is None:
            from actors.suggest import did_you_mean  # late: it brings the whole framework

            near = did_you_mean(argv[0], self.verbs, quoted=False)
            raise UsageError(f"{prog}: there is no verb {argv[0]!r}{near} (see {prog} --help)")
        return verb.main(argv[1:], prog)


def carried_out(run: Run, options: argparse.Namespace) -> int | Exit:
    """Call `run`; a coroutine runs on an event loop until it ends or a signal cancels it."""
    ended = run(options)
    if isinstance(ended, (int, Exit)):
        return ended
    if threading.current_thread() is threading.main_thread():
        # Until the event loop listens, Ctrl-C ends the process: there is nothing yet to be ended in order.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    import asyncio  # late, so that no help waits for it

    return asyncio.run(until_signal(ended))


async def until_signal(verb: Coroutine[Any, Any, int | Exit]) -> int | Exit:
    """Run a verb. A signal, or the end of the program that reads its output, cancels it, so that it leaves the graph in order; a second
    signal, half a second or more after the first, ends the process at once."""
    import asyncio

    task = asyncio.current_task()
    assert task is not None
    came: list[int] = []

    def end(number: int) -> bool:
        if came:
            os._exit(128 + number)
        came.append(number)
        task.cancel()
        return True

    leave: Callable[[], None] = lambda: None  # noqa: E731
    if threading.current_thread() is threading.main_thread():
        from actors.running.signals import listen

        leave = listen(asyncio.get_running_loop(), end)
    try:
        return await verb
    except asyncio.CancelledError:
        if not came:
            raise
        return Exit.by(came[0])
    finally:
        leave()
