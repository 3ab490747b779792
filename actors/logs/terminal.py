"""Text of others on a terminal: what would control it is shown as an escape."""

from __future__ import annotations

import re
from typing import Final

CONTROLS: Final = "\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069"
"""C0 and C1 controls, other line breaks, and what changes the direction of text; as in a character class of `re`."""
_CONTROL: Final = re.compile(f"(?![\n\t])[{CONTROLS}]")


def shown(text: str, indent: str | None = None) -> str:
    r"""The text with its control characters as escapes, such as ``\x1b``; tabs and line breaks stay, each of these followed by `indent` if it is
    given, so that no line of the text looks like one of its own."""
    if _CONTROL.search(text) is not None:
        text = _CONTROL.sub(lambda found: repr(found[0])[1:-1], text)
    return text if indent is None else text.replace("\n", f"\n{indent}")
