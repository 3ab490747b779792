"""`list`, `type` and `find` of the topics, services and actions of the graph."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cli.command import Exit
from cli.parsing import Parser, add_graph_verb

if TYPE_CHECKING:
    from cli.graph.view import GraphView


@dataclass(frozen=True)
class Kind:
    """What these verbs name."""

    word: str
    """Such as ``topic``."""
    example: str
    type_example: str
    found: Callable[[GraphView, bool], dict[str, list[str]]]
    """All of them with their types; the hidden ones, too, if wanted."""
    hides: bool = True
    """Whether there are hidden ones."""

    def add_name(self, parser: Parser) -> None:
        """The argument for one of them."""
        parser.add_argument(f"{self.word}_name", help=f"for instance {self.example}")

    def list_arguments(self, parser: Parser) -> None:
        parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
        self._count(parser)
        self._common(parser)

    def type_arguments(self, parser: Parser) -> None:
        self.add_name(parser)
        self._common(parser)

    def find_arguments(self, parser: Parser) -> None:
        parser.add_argument(f"{self.word}_type", help=f"for instance {self.type_example}")
        self._count(parser)
        self._common(parser)

    def _count(self, parser: Parser) -> None:
        parser.add_argument("-c", f"--count-{self.word}s", action="store_true", help="only how many", dest="counted")

    def _common(self, parser: Parser) -> None:
        parser.set_defaults(kind=self, hidden=False)
        if self.hides:
            parser.add_argument(
                f"--include-hidden-{self.word}s",
                action="store_true",
                help="also those with a part that begins with _",
                dest="hidden",
            )
        add_graph_verb(parser)


async def list_names(options: argparse.Namespace) -> Exit:
    """The names, one a line; with their types, or only how many they are."""
    from cli.graph.view import look

    async with look(options) as view:
        print_names(options.kind.found(view, options.hidden), options, types=options.show_types)
    return Exit.DONE


async def find(options: argparse.Namespace) -> Exit:
    """The names of those that have the type, or only how many they are."""
    from cli.graph.view import look

    wanted: str = getattr(options, f"{options.kind.word}_type")
    async with look(options) as view:
        found = options.kind.found(view, options.hidden)
    print_names({name: types for name, types in found.items() if wanted in types}, options)
    return Exit.DONE


async def type_of(options: argparse.Namespace) -> Exit:
    """The types of one of them, one a line; 1 and nothing if there is none of that name."""
    from cli.graph.view import absolute, look
    from cli.output import print_json

    kind: Kind = options.kind
    name = absolute(getattr(options, f"{kind.word}_name"))
    async with look(options, lambda view: name in kind.found(view, True)) as view:
        types = kind.found(view, True).get(name, [])
    print_json(types) if options.json else print("\n".join(types), end="\n" if types else "")
    return Exit.DONE if types else Exit.FAILED


def print_names(found: dict[str, list[str]], options: argparse.Namespace, *, types: bool = False) -> None:
    """Print them as the options want it."""
    from cli.output import print_json

    if options.counted:
        print_json(len(found)) if options.json else print(len(found))
    elif options.json:
        print_json([{"name": name, "types": each} for name, each in found.items()])
    else:
        for name, each in found.items():
            print(f"{name} [{', '.join(each)}]" if types else name)
