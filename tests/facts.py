"""What a message must tell, whatever its wording: names, values, and what to do next."""

from __future__ import annotations

import re


def lacks(told: str, facts: str) -> list[str]:
    """Which of these words, separated by spaces, do not stand in a message as whole words. The message is one line."""
    assert len(told.splitlines()) == 1, told
    return [fact for fact in facts.split() if not re.search(rf"(?<![\w-])(?<!\d\.){re.escape(fact)}(?!\w|\.\d)", told)]
