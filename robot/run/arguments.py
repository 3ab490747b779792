"""What the parsers of the robot's commands share: mistakes in one line, and the types of their arguments."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from math import isfinite, nan

LEVELS = ("debug", "info", "warn", "error", "fatal")
"""What may be said for `--log-level`."""


def parse_seed(text: str) -> int:
    """A seed of random numbers, for argparse: a whole number that is not negative."""
    try:
        value = int(text)
    except ValueError:
        value = -1
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is no seed: give a whole number of at least 0")
    return value


def within(low: float, high: float, unit: str) -> Callable[[str], float]:
    """A number within bounds, for argparse."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = nan
        if not low <= value <= high:  # also true for NaN
            raise argparse.ArgumentTypeError(f"{text}: give {low:g} to {high:g} {unit}")
        return value

    return parse


def whole(low: int, high: int) -> Callable[[str], int]:
    """A whole number within bounds, for argparse."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text}: give a whole number from {low} to {high}")
        return value

    return parse


def seconds(text: str) -> float:
    """A positive number of seconds, for argparse."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not isfinite(value) or value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number of seconds")
    return value
