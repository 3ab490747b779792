"""`completion bash | zsh | fish`: a script for a shell, and the words that it asks for.

The script asks this program for the words that may come next: commands, verbs and options from their parsers, and the names of topics,
nodes, services, actions and types that the graph has at that moment.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from importlib import import_module
from importlib.util import find_spec

from cli.command import GROUPS, CommandFailed, Exit, module_of
from cli.parsing import Verbs, actions_of, add_common

__all__ = ["candidates", "main"]

COMMANDS = ("run", "evaluate", "picture", *GROUPS)

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


def main(argv: Sequence[str]) -> int | Exit:
    """Print the script for a shell, or the words that may come next."""
    words = list(argv)
    if words[:1] == ["words"]:
        print("\n".join(candidates(words[2:] if words[1:2] == ["--"] else words[1:])))
        return Exit.DONE
    parser = argparse.ArgumentParser(
        prog="python -m robot completion",
        description="A completion script for robactor.",
        epilog='bash: eval "$(robactor completion bash)"; zsh: the same with zsh; fish: robactor completion fish | source',
    )
    parser.add_argument("shell", choices=tuple(_SCRIPTS))
    print(_SCRIPTS[parser.parse_args(words).shell], end="")
    return Exit.DONE


def candidates(words: Sequence[str]) -> list[str]:
    """What may stand for the last of these words, which may be empty; the words before it are complete."""
    if len(words) < 2:
        return [command for command in COMMANDS if command.startswith(words[0] if words else "")]
    group, *before, last = words
    if group not in GROUPS:
        return []
    if find_spec(f"cli.{group}") is None or not hasattr(module := import_module(module_of(group)), "verbs"):
        return []
    return [word for word in _of_group(module.verbs(), before, last) if word.startswith(last)]


def _of_group(group: Verbs, before: Sequence[str], last: str) -> Iterable[str]:
    if not before:
        return list(group.parsers)
    parser = group.parsers.get(before[0])
    if parser is None:
        return ()
    actions = actions_of(parser)
    if last.startswith("-"):
        return [option for action in actions for option in action.option_strings]
    taking = next((action for action in actions if before[-1] in action.option_strings), None)
    if taking is not None and taking.nargs != 0:
        return [str(choice) for choice in taking.choices or ()]
    places = [action for action in actions if not action.option_strings]
    given = [word for word in before[1:] if not word.startswith("-")]
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
    from cli.types import learn_folders

    learn_folders(argparse.Namespace(interfaces=[]))
    return known_names()


async def _in_graph(place: str, given: Sequence[str]) -> list[str]:
    from cli.view import look

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
