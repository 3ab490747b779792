"""Key expressions: which keys they match."""

from __future__ import annotations

import re

_CHUNK = "/[^/@][^/]*"
"""What a wildcard stands for: a chunk that begins with ``@`` is matched by its own text only."""


def matcher(expression: str) -> re.Pattern[str]:
    """A pattern whose `fullmatch` is true for ``/`` and a key that the expression matches.

    ``*`` is one chunk, ``**`` any number of them, none too; neither includes chunks that begin with ``@``.
    """
    wildcards = {"*": _CHUNK, "**": f"(?:{_CHUNK})*"}
    return re.compile("".join(wildcards.get(chunk) or "/" + re.escape(chunk) for chunk in expression.split("/")))
