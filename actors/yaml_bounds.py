"""YAML of strangers, bounded before it is understood: how much its aliases stand for, how deep it is nested, and what its reader raises."""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType
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
    library = _library()
    sizes: dict[str, int] = {}
    open_: list[tuple[str | None, int]] = []
    total = 0
    for event in library.parse(text, Loader=safe_loader()):
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


def load_yaml(text: str) -> Any:
    """The value that a text from outside stands for. Raises `yaml.YAMLError` for whatever is wrong with it."""
    check_yaml(text)
    return _library().load(text, Loader=safe_loader())


@lru_cache(maxsize=1)
def safe_loader() -> Any:
    """The loader class to read texts from outside with: PyYAML's `SafeLoader`, which raises nothing but `yaml.YAMLError`, with the place.

    PyYAML itself raises `ValueError`, `OverflowError`, `LookupError` and `AttributeError`, too: for 2001-99-99, a number of 5000 digits,
    ``"\\U00110000"``, ``!!bool maybe`` and ``!!timestamp x``.
    """
    library = _library()
    base: Any = library.SafeLoader

    class Loader(base):  # type: ignore[misc]  # PyYAML has no types
        def __init__(self, text: str) -> None:
            try:
                base.__init__(self, text)
            except library.reader.ReaderError as error:  # its text has two lines and no place
                before = text[: error.position].rpartition("\n")
                at = library.Mark(
                    "", error.position, before[0].count("\n") + len(before[1]), len(before[2]), None, None
                )
                problem = f"the character U+{ord(text[error.position]):04X} is not allowed; take it out"
                raise library.scanner.ScannerError(None, None, problem, at) from None

        def fetch_more_tokens(self) -> None:
            try:
                base.fetch_more_tokens(self)
            except (ValueError, OverflowError) as error:
                raise library.scanner.ScannerError(None, None, str(error), self.get_mark()) from None

        def construct_object(self, node: Any, deep: bool = False) -> object:
            try:
                return base.construct_object(self, node, deep)
            except (ValueError, OverflowError, LookupError, AttributeError):
                problem = f"{node.value!r:.40} is no {node.tag.rpartition(':')[2]}"
                raise library.constructor.ConstructorError(None, None, problem, node.start_mark) from None

    return Loader


def _library() -> ModuleType:
    import yaml  # late: most programs read none

    return yaml
