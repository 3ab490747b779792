"""The errors of transforms, with the names that tf2 gives them. Their texts say what is there instead."""

from __future__ import annotations

from actors.errors import ActorError


class TransformException(ActorError):
    """Base of all errors of `actors.tf2`."""


class LookupException(TransformException, LookupError):
    """There is no frame of this name; the text names the nearest ones."""


class ConnectivityException(TransformException, LookupError):
    """Both frames are known, but no chain of transforms leads from one to the other; the text names the root of each."""


class ExtrapolationException(TransformException, LookupError):
    """The transforms are not known at the time asked for; the text says for which interval they are. One of the three below is raised."""

    past: bool = False
    """Whether the time is before everything known, so that waiting is useless."""


class BackwardExtrapolationException(ExtrapolationException):
    """The time is before the first transform that is still kept."""

    past = True


class ForwardExtrapolationException(ExtrapolationException):
    """The time is after the last transform."""


class NoDataForExtrapolationException(ExtrapolationException):
    """There is one transform only, of another time, or none any more after the buffer was cleared."""

    def __init__(self, text: str, *, past: bool = False) -> None:
        super().__init__(text)
        self.past = past


class InvalidArgumentException(TransformException, ValueError):
    """A frame name is empty or begins with a slash, or a transform cannot be: no numbers, no rotation, a loop of frames."""


class TimeoutException(TransformException, TimeoutError):
    """A buffer server did not answer in time. What does not come to a `Buffer` in time raises what is the matter instead."""


class DescriptionError(ActorError, ValueError):
    """The robot's description is no URDF."""
