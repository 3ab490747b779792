"""The PNG of `plot`, by matplotlib: one panel for each field, over one time axis."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Final

from matplotlib.figure import Figure

WIDTH: Final = 900
PANEL: Final = 240
"""Pixels."""
DOTS: Final = 100
"""Pixels of an inch, in which matplotlib counts."""


def picture(series: Sequence[tuple[str, Sequence[float], Sequence[float]]]) -> bytes:
    """The file's bytes. Each series has a name, times in seconds, and at least one value."""
    size = WIDTH / DOTS, PANEL * len(series) / DOTS
    figure = Figure(figsize=size, dpi=DOTS, layout="constrained")
    panels = figure.subplots(len(series), sharex=True, squeeze=False)
    for panel, (name, times, values) in zip(panels[:, 0], series, strict=True):
        panel.plot(times, values)
        panel.set_title(name, loc="left")
        panel.grid(visible=True)
    panels[-1, 0].set_xlabel("seconds")
    file = BytesIO()
    figure.savefig(file, format="png")  # pyright: ignore[reportUnknownMemberType]
    return file.getvalue()
