"""Spoken words to velocities, in English and Portuguese, with or without accents.

A misheard sentence must never move the robot: only a single exact word does. A word for stopping, though, stops
wherever it is heard, so "stop going forward" stands still and "don't go forward" does nothing.
"""

from __future__ import annotations

import re
import unicodedata
from types import MappingProxyType

from robot.geometry.planar import ZERO_TWIST, Twist2

_STOP = frozenset({"stop", "parar"})
_FORWARD, _BACK = Twist2(1.0, 0.0, 0.0), Twist2(-1.0, 0.0, 0.0)
_LEFT, _RIGHT = Twist2(0.0, 0.0, 1.0), Twist2(0.0, 0.0, -1.0)

WORDS = MappingProxyType(
    {
        "forward": _FORWARD,
        "frente": _FORWARD,
        "back": _BACK,
        "tras": _BACK,
        "left": _LEFT,
        "esquerda": _LEFT,
        "right": _RIGHT,
        "direita": _RIGHT,
        "stop": ZERO_TWIST,
        "parar": ZERO_TWIST,
    }
)
"""Every word that is understood, in lower case and without accents, and what it asks for (1.0 m/s, 1.0 rad/s)."""


def interpret(text: str) -> Twist2 | None:
    """The velocity that `text` asks for; `None` if it is not understood, and then nothing may move.

    Case, accents, punctuation and spaces around the word do not matter.
    """
    plain = "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if not unicodedata.combining(c))
    words = re.findall(r"[^\W_]+", plain)
    if not _STOP.isdisjoint(words):
        return ZERO_TWIST
    return WORDS.get(words[0]) if len(words) == 1 else None
