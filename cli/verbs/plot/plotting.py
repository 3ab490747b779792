"""What `plot` collects, and how it draws."""

from __future__ import annotations

import argparse
import asyncio
import shutil
import sys
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from typing import IO, Any, NamedTuple

from actors.interfaces import Message
from actors.names.names import is_hidden
from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.graph.looking import until_one_ends
from cli.graph.seen import Seen, seen
from cli.graph.view import absolute
from cli.output import control
from cli.verbs.topic.echo import field_of, topic_of

PERIOD = 0.2
"""Seconds between two pictures."""

HEIGHT = 12
"""Lines of a plot in the terminal."""

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""The bits of the dots of a braille character, by row and column."""


class Series(NamedTuple):
    """The samples of one field: times in seconds since the beginning, and values."""

    name: str
    times: list[float]
    values: list[float]

    def last(self, seconds: float) -> Series:
        """Those of the last so many seconds."""
        since = self.times[-1] - seconds if self.times else 0.0
        first = next((index for index, moment in enumerate(self.times) if moment >= since), 0)
        return Series(self.name, self.times[first:], self.values[first:])


def split(text: str, topics: Sequence[str]) -> tuple[str, str]:
    """The topic and the path of the field that ``/imu/data/angular_velocity/z`` names. Raises `CommandFailed` if no topic fits."""
    found = _topic_in(text, topics)
    if found is None:
        hint = did_you_mean(absolute(text.partition("[")[0]), topics)
        raise CommandFailed(
            f"{text}: no topic of the graph begins so{hint}; write TOPIC/FIELD, such as /imu/data/angular_velocity/z"
        )
    path = absolute_text(text)[len(found) + 1 :].replace("[", ".[").replace("/", ".")
    return found, path


def _topic_in(text: str, topics: Sequence[str]) -> str | None:
    """The longest topic with which a text begins."""
    name = absolute(text.partition("[")[0])
    return max((topic for topic in topics if name.startswith(f"{topic}/")), key=len, default=None)


def _topics(graph: Seen) -> list[str]:
    """The topics that somebody publishes, but for hidden ones."""
    topics = graph.system.graph.topics
    return [name for name, entry in topics.items() if entry.publishers and not is_hidden(name)]


def absolute_text(text: str) -> str:
    """The text with a leading slash."""
    return text if text.startswith("/") else f"/{text}"


async def plot(options: argparse.Namespace) -> Exit:
    """Collect samples, and draw them every moment if the output is a terminal; at the end in any case."""
    if options.png is not None:
        _require_matplotlib()
    async with seen(options) as graph:
        await graph.late(lambda: all(_topic_in(text, _topics(graph)) for text in options.fields), options.spin_time)
        chosen = [split(text, _topics(graph)) for text in options.fields]
        series = [Series(absolute_text(text), [], []) for text in options.fields]
        drawn = options.csv != "-"
        with _table(options.csv) as table:
            begin = time.monotonic()
            work = [
                _collect(graph, options, *where, one, begin, table) for where, one in zip(chosen, series, strict=True)
            ]
            try:
                await until_one_ends(_show(series, options, begin, drawn=drawn), *work)
            finally:
                if drawn and any(one.values for one in series):
                    _draw(series, options)
                if options.png is not None:
                    _write_png(series, options.png)
    return Exit.DONE


async def _collect(
    graph: Seen, options: argparse.Namespace, topic: str, path: str, series: Series, begin: float, table: IO[str] | None
) -> None:
    of_topic = argparse.Namespace(**{**vars(options), "topic_name": topic, "message_type": None})
    async with graph.node.subscribe(await topic_of(graph, of_topic)) as messages:
        async for message in messages:
            value = field_of(message, path)
            if not isinstance(value, (int, float)):
                raise CommandFailed(f"{series.name} is no number but {_kind(value)}")
            moment = time.monotonic() - begin
            series.times.append(moment)
            series.values.append(float(value))
            if table is not None:
                table.write(f"{moment:.6f},{series.name},{value}\n")


def _kind(value: Any) -> str:
    if isinstance(value, Message):
        return f"a {value.__ros_type__}: name one of {', '.join(field.name for field in value.__ros_fields__)}"
    return (
        "an array: name an item, as in NAME[0]"
        if hasattr(value, "__len__") and not isinstance(value, str)
        else "a text"
    )


@contextmanager
def _table(path: str | None) -> Generator[IO[str] | None]:
    """The CSV file that is wanted, open for the block; None if none is."""
    if path is None or path == "-":
        if path is not None:
            print("time,field,value")
        yield None if path is None else sys.stdout
        return
    try:
        file = open(path, "w", encoding="utf-8")  # noqa: SIM115
    except OSError as error:
        raise CommandFailed(f"{path} cannot be written: {error.strerror}") from None
    with file:
        file.write("time,field,value\n")
        yield file


async def _show(series: Sequence[Series], options: argparse.Namespace, begin: float, *, drawn: bool) -> None:
    """Draw every moment on a terminal, until the time is over."""
    live = drawn and sys.stdout.isatty()
    end = float("inf") if options.duration is None else begin + options.duration
    while time.monotonic() < end:
        await asyncio.sleep(min(PERIOD, max(0, end - time.monotonic())))
        if live:
            _draw(series, options, "\x1b[H\x1b[2J")


def _draw(series: Sequence[Series], options: argparse.Namespace, before: str = "") -> None:
    width = shutil.get_terminal_size((80, 24)).columns
    lines = [line for one in series for line in braille(one.last(options.window), width, HEIGHT)]
    control(before)
    print("\n".join(lines), flush=True)


def braille(series: Series, width: int, height: int) -> Iterator[str]:
    """A plot of `height` lines in braille dots, with the greatest and the least value beside it, and its figures below."""
    yield series.name
    if not series.values:
        yield "(no samples yet)"
        return
    low, high = min(series.values), max(series.values)
    marks = f"{high:.4g}", f"{low:.4g}"
    margin = max(map(len, marks))
    columns = max(2, width - margin - 1)
    cells = [[0] * columns for _ in range(height)]
    first, span = series.times[0], max(series.times[-1] - series.times[0], 1e-9)
    for moment, value in zip(series.times, series.values, strict=True):
        x = round((moment - first) / span * (2 * columns - 1))
        y = round((high - value) / (high - low) * (4 * height - 1)) if high > low else 2 * height
        cells[y // 4][x // 2] |= _DOTS[y % 4][x % 2]
    for row, cell in enumerate(cells):
        mark = marks[0] if row == 0 else marks[1] if row == height - 1 else ""
        yield f"{mark:>{margin}} " + "".join(chr(0x2800 + bits) for bits in cell)
    mean = sum(series.values) / len(series.values)
    rate = (len(series.times) - 1) / span if len(series.times) > 1 else 0.0
    yield f"{'':>{margin}} {span:.3g} s, {len(series.values)} samples, {rate:.4g} Hz, mean {mean:.4g}"


def _require_matplotlib() -> None:
    """Raise `CommandFailed` before anything is collected that could not be drawn."""
    if find_spec("matplotlib") is None:
        raise CommandFailed("--png needs matplotlib: pip install 'robactor[plots]'; --csv needs nothing")


def _write_png(series: Sequence[Series], path: str) -> None:
    """A picture of all samples."""
    from cli.verbs.plot.picture import picture

    found = [one for one in series if one.values]
    if not found:
        raise CommandFailed(f"{path} is not written: there are no samples")
    try:
        with open(path, "wb") as file:
            file.write(picture([(one.name, one.times, one.values) for one in found]))
    except OSError as error:
        raise CommandFailed(f"{path} cannot be written: {error.strerror}") from None
