"""YAML of strangers, bounded before it is understood: how much its aliases stand for, and how deep it is nested."""

from __future__ import annotations

from typing import Any, Final

MOST: Final = 100_000
"""Values that a document with aliases may hold when each alias is replaced by what it stands for."""
DEEPEST: Final = 100
"""Levels of nesting: PyYAML recurses once and more for each."""


def check_yaml(text: str) -> None:
    """Raise `yaml.YAMLError`, with its place, for a text whose aliases multiply into too much, or that is nested too deeply to be read.

    Call it before a text from outside is loaded or composed. It takes time only where the text has aliases or many brackets or dashes.
    """
    aliases = "&" in text and "*" in text
    if not aliases and text.count("[") + text.count("{") + text.count("- ") + text.count(":\n") < DEEPEST:
        return
    import yaml  # late: most programs read none

    library: Any = yaml
    sizes: dict[str, int] = {}
    open_: list[tuple[str | None, int]] = []
    total = 0
    for event in library.parse(text, Loader=library.SafeLoader):
        if isinstance(event, library.AliasEvent):
            total += sizes.get(event.anchor, 0)
        elif isinstance(event, library.ScalarEvent):
            total += 1
            if event.anchor:
                sizes[event.anchor] = 1
        elif isinstance(event, library.CollectionStartEvent):
            total += 1
            open_.append((event.anchor, total))
        elif isinstance(event, library.CollectionEndEvent):
            anchor, before = open_.pop()
            if anchor:
                sizes[anchor] = total - before + 1
        problem = "its aliases stand for too many values" if aliases and total > MOST else ""
        problem = f"it is nested more than {DEEPEST} levels deep" if len(open_) > DEEPEST else problem
        if problem:
            raise library.MarkedYAMLError(None, None, problem, event.start_mark)
