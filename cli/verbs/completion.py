"""`completion bash | zsh | fish`: a script for a shell, and the words that it asks for.

The script asks this program for the words that may come next: commands, verbs and options from their parsers, and the names of topics,
nodes, services, actions and types that the graph has at that moment.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence

from cli.command import COMMANDS, CommandFailed, Exit, added, found
from cli.parsing import Parser, actions_of, add_common
from cli.verb import Group, Verb

_SCRIPTS = {
    "bash": """\
_robactor() {
    local IFS=$'\\n'
    COMPREPLY=($(compgen -W "$(robactor completion words -- "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)" -- "${COMP_WORDS[COMP_CWORD]}"))
}
complete -o default -F _robactor robactor
""",
    "zsh": """\
#compdef robactor
_robactor() {
    local -a found
    found=(${(f)"$(robactor completion words -- "${(@)words[2,CURRENT]}" 2>/dev/null)"})
    compadd -a found || _files
}
compdef _robactor robactor
""",
    "fish": """\
complete -c robactor -f -a '(robactor completion words -- (commandline -opc)[2..] (commandline -ct) 2>/dev/null)'
""",
}


def _parse(parser: Parser, argv: Sequence[str]) -> argparse.Namespace:
    words = list(argv)
    if words[:1] == ["words"]:
        return argparse.Namespace(words=words[2:] if words[1:2] == ["--"] else words[1:])
    return parser.parse_args(words)


def _arguments(parser: Parser) -> None:
    parser.add_argument("shell", choices=tuple(_SCRIPTS))


def _run(options: argparse.Namespace) -> Exit:
    """Print the script for a shell, or the words that may come next."""
    print("\n".join(candidates(options.words)) if "words" in options else _SCRIPTS[options.shell].rstrip("\n"))
    return Exit.DONE


def candidates(words: Sequence[str]) -> list[str]:
    """What may stand for the last of these words, which may be empty; the words before it are complete."""
    *before, last = words or [""]
    if not before:
        every = [*(entry.name for entry in added()), *COMMANDS]
        return [command for command in every if command.startswith(last)]
    command = found(before.pop(0))
    if isinstance(command, Group):
        if not before:
            return [verb for verb in command.verbs if verb.startswith(last)]
        command = command.verbs.get(before.pop(0))
    if not isinstance(command, Verb):
        return []
    return [word for word in _of_verb(command.parser(), before, last) if word.startswith(last)]


def _of_verb(parser: Parser, before: Sequence[str], last: str) -> Iterable[str]:
    actions = actions_of(parser)
    if last.startswith("-"):
        return [option for action in actions for option in action.option_strings]
    taking = next((action for action in actions if before and before[-1] in action.option_strings), None)
    if taking is not None and taking.nargs != 0:
        return [str(choice) for choice in taking.choices or ()]
    places = [action for action in actions if not action.option_strings]
    given = [word for word in before if not word.startswith("-")]
    return _names(places[min(len(given), len(places) - 1)].dest, given) if places else ()


def _names(place: str, given: Sequence[str]) -> list[str]:
    """The names of the graph, or the types, for a place of a verb."""
    if place in ("type", "package_name", "topic_type", "service_type", "action_type", "message_type") and not given:
        return _types()
    import asyncio

    try:
        return asyncio.run(_in_graph(place, given))
    except CommandFailed:
        return []


def _types() -> list[str]:
    from actors.interfaces import known_names
    from cli.graph.types import learn_folders

    learn_folders(argparse.Namespace(interfaces=[]))
    return known_names()


async def _in_graph(place: str, given: Sequence[str]) -> list[str]:
    from cli.graph.view import look

    parser = argparse.ArgumentParser()
    add_common(parser)
    async with look(parser.parse_args([])) as view:
        return {
            "topic_name": lambda: list(view.topics(hidden=False)),
            "service_name": lambda: list(view.services(hidden=False)),
            "action_name": lambda: list(view.actions()),
            "node_name": lambda: view.nodes(hidden=False),
            "message_type": lambda: view.topics().get(given[0], []),
            "service_type": lambda: view.services().get(given[0], []),
            "action_type": lambda: view.actions().get(given[0], []),
        }.get(place, list)()


COMMAND = Verb(
    "completion",
    "for bash, zsh and fish",
    _arguments,
    _run,
    description="A completion script for robactor.",
    epilog='bash: eval "$(robactor completion bash)"; zsh: the same with zsh; fish: robactor completion fish | source',
    parse=_parse,
)
