"""What was probably meant by a name that does not exist: the one place where errors get their "did you mean" from."""

from __future__ import annotations

from collections.abc import Iterable


def nearest(name: str, known: Iterable[str], *, most: int = 1, cutoff: float = 0.6) -> list[str]:
    """The known names that resemble `name`, the best first, at most `most`; `cutoff` is the least resemblance, 0 to 1."""
    from difflib import get_close_matches  # late: it is needed only when something is already wrong

    return get_close_matches(name, list(known), n=most, cutoff=cutoff)


def did_you_mean(
    name: str, known: Iterable[str], lead: str = "; did", *, most: int = 1, cutoff: float = 0.6, quoted: bool = True
) -> str:
    """``; did you mean 'speed'?``, or ``... 'a' or 'b'?``, if something of nearly that name is known; else nothing.

    `lead` is what stands before "you mean"; without `quoted` the names stand without quotation marks.
    """
    found = nearest(name, known, most=most, cutoff=cutoff)
    return f"{lead} you mean {' or '.join(map(repr, found) if quoted else found)}?" if found else ""


def near_name(name: str, known: Iterable[str]) -> str:
    """As `did_you_mean`, for full names of the graph: one that resembles `name`, or its last part in another namespace."""
    names = list(known)
    last = name.rpartition("/")[2]
    found = nearest(name, names, cutoff=0.7) or [each for each in names if each.rpartition("/")[2] == last]
    return f"; did you mean {found[0]!r}?" if found else ""
