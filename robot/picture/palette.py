"""The colours of all pictures, given as people pick them (sRGB) and used as light (linear)."""

from __future__ import annotations

from robot.picture.solids import Colour


def linear(text: str) -> Colour:
    """`rrggbb` as linear light."""
    channels = [int(text[i : i + 2], 16) / 255.0 for i in (0, 2, 4)]
    r, g, b = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)
    return r, g, b


# The robot.
ROBOT = linear("f5b30a")
GRAPHITE = linear("33363b")
DARK = linear("1b1d20")
RUBBER = linear("141416")
GLASS = linear("0b1c2b")
JOINT = linear("55595f")
CHARGE = linear("35d0a0")

# The warehouse.
CONCRETE = linear("b3a38b")
LINE = linear("8d7e69")
WALL = linear("e3d3b8")
DADO = linear("8f7a63")
PILLAR = linear("bdb5a8")
FRAME = linear("2f5f8f")
STEEL = linear("c8672a")
BOARD = linear("a58863")
CRATE = linear("b98a55")
CARTONS = (linear("b98d5e"), linear("c89f6f"), linear("a87c4f"), linear("d2b083"), linear("8f9aa0"))
HAZARD = linear("f2b90c")
BLACK = linear("222222")
WHITE = linear("f6f3ec")
HAZE = linear("e9dfcd")
SKY = linear("dfe6ea")

# What is drawn on the floor.
PATH = linear("0a5fc4")
TRAIL = linear("d9540e")
PRINT = linear("7a3a12")
