"""A small alphabet of strokes: letters, digits and what units and numbers need. Capitals are written as small letters.

A glyph is a few strokes of points; a point is two digits, x from 0 and y from 0 with the baseline at 2, small letters up to
6 and tall ones up to 8. A stroke of one point is a dot.
"""

from __future__ import annotations

from typing import Final

__all__ = ["ADVANCE", "BASELINE", "TALL", "strokes", "width"]

BASELINE: Final = 2
TALL: Final = 6
"""Height of digits over the baseline, in the glyphs' units."""
ADVANCE: Final = 1.7
"""From one glyph's right edge to the next one's left edge."""
SPACE: Final = 2.0

Stroke = list[tuple[float, float]]

GLYPHS: Final = {
    "0": "12 03 07 18 38 47 43 32 12", "1": "17 28 22,12 32", "2": "07 18 38 47 46 02 42",
    "3": "07 18 38 47 46 35 25,35 44 43 32 12 03", "4": "32 38 04 44", "5": "48 08 05 35 44 43 32 12 03",
    "6": "47 38 18 07 03 12 32 43 44 35 15 04", "7": "08 48 12", "8": "15 06 07 18 38 47 46 35 15 04 03 12 32 43 44 35",
    "9": "03 12 32 43 47 38 18 07 06 15 35 46", ".": "02", ",": "12 01", "-": "05 35", "+": "05 45,23 27", "/": "01 38",
    "(": "10 02 06 18", ")": "00 12 16 08", ":": "03,06", "a": "35 26 16 05 03 12 22 33,36 32",
    "b": "08 02,05 16 26 35 33 22 12 03", "c": "35 26 16 05 03 12 22 33", "d": "38 32,35 26 16 05 03 12 22 33",
    "e": "04 34 35 26 16 05 03 12 32", "f": "28 17 12,06 26", "g": "36 31 20 00,35 26 16 05 03 12 22 33",
    "h": "08 02,05 16 26 35 32", "i": "06 02,08", "j": "16 11 00,18", "k": "08 02,36 04 32", "l": "08 03 12",
    "m": "06 02,05 16 25 22,25 36 45 42", "n": "06 02,05 16 26 35 32", "o": "12 03 05 16 26 35 33 22 12",
    "p": "06 00,05 16 26 35 33 22 12 03", "q": "36 30,35 26 16 05 03 12 22 33", "r": "06 02,05 16 26",
    "s": "36 16 05 14 24 33 22 02", "t": "18 13 22,06 26", "u": "06 03 12 22 33,36 32", "v": "06 22 46",
    "w": "06 12 25 32 46", "x": "06 32,02 36", "y": "06 22,46 10", "z": "06 36 02 32",
}  # fmt: skip


def strokes(text: str) -> list[Stroke]:
    """The strokes of a line of text from (0, 0), y upwards from the baseline. Characters without a glyph are left blank."""
    found: list[Stroke] = []
    pen = 0.0
    for letter in text.lower():
        glyph = GLYPHS.get(letter)
        if glyph is None:
            pen += SPACE + ADVANCE
            continue
        for stroke in glyph.split(","):
            found.append([(pen + int(point[0]), float(int(point[1]) - BASELINE)) for point in stroke.split()])
        pen += _extent(glyph) + ADVANCE
    return found


def width(text: str) -> float:
    """How wide the line is."""
    glyphs = (GLYPHS.get(letter) for letter in text.lower())
    return max(0.0, sum((SPACE if glyph is None else _extent(glyph)) + ADVANCE for glyph in glyphs) - ADVANCE)


def _extent(glyph: str) -> int:
    return max(int(point[0]) for stroke in glyph.split(",") for point in stroke.split())
