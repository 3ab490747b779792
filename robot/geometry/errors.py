"""What can be wrong with a question about frames, or with a transform that is told."""

from __future__ import annotations

__all__ = [
    "DescriptionError",
    "Extrapolation",
    "FrameError",
    "InvalidTransform",
    "NotATree",
    "NotConnected",
    "UnknownFrame",
]


class FrameError(Exception):
    """Base of all errors of `robot.frames`."""


class UnknownFrame(FrameError, LookupError):
    """Nobody has told of a frame of this name; the text names the closest ones."""


class NotConnected(FrameError, LookupError):
    """Both frames are known, but no chain of transforms leads from one to the other."""


class Extrapolation(FrameError, LookupError):
    """The time asked for lies outside of what is known; the text says which span is."""

    def __init__(self, text: str, *, past: bool = False) -> None:
        super().__init__(text)
        self.past = past
        """Whether it lies before everything that is still known: waiting will not help."""


class NotATree(FrameError, ValueError):
    """The transform would make a loop of frames, or give a frame a second parent."""


class InvalidTransform(FrameError, ValueError):
    """The transform has no frame names, a number that is not finite, or a rotation that is none."""


class DescriptionError(FrameError, ValueError):
    """The robot's description is no URDF, or has joints that nobody here can compute."""
