"""The tree of frames: every frame has one parent at a time, and any two frames under one root can be asked for at any known instant.

Instants are nanoseconds; 0 asks for the latest instant at which all transforms on the way are known.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from types import MappingProxyType

from actors.suggest import did_you_mean
from actors.tf2.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from actors.tf2.time_cache import TimeCache, seconds
from actors.tf2.transform import Transform

IDENTITY = Transform()


class FrameTree:
    """Transforms between frames over the last `keep` nanoseconds.

    Invariants:

    - Each frame that was ever given as a child has a track, which may be empty after `clear`.
    - `names` holds every frame that was ever given, as child or parent.
    - The newest parents make no loop.
    """

    def __init__(self, keep: int) -> None:
        self._keep = keep
        self._tracks: dict[str, TimeCache] = {}
        self.names: set[str] = set()

    @property
    def tracks(self) -> Mapping[str, TimeCache]:
        """The transforms of each frame to its parent."""
        return MappingProxyType(self._tracks)

    def insert(
        self, parent: str, child: str, instant: int, transform: Transform, *, static: bool, authority: str
    ) -> bool:
        """Take in one transform. Returns False, and does nothing, if it is older than what is kept.

        Raises `InvalidArgumentException` for a frame without a name, and for a transform that would close a loop.
        """
        parent, child = parent.removeprefix("/"), child.removeprefix("/")
        if not parent or not child:
            raise InvalidArgumentException(
                f"{parent!r} -> {child!r} (by {authority}): both frames need a name; set header.frame_id and child_frame_id"
            )
        track = self._tracks.get(child)
        if track is None or track.parent != parent:
            self._refuse_loop(parent, child)
        if track is None or track.static != static:
            track = self._tracks[child] = TimeCache(child, self._keep, static=static)
            self.names |= {parent, child}
        elif track.parent != parent:
            self.names.add(parent)
        return track.add(instant, parent, transform, authority)

    def lookup(self, target: str, source: str, instant: int) -> tuple[Transform, int]:
        """What takes points given in `source` to `target`, and the instant of it. Raises a `TransformException`."""
        if target == source:
            track = self._tracks.get(target)
            return IDENTITY, instant or (0 if track is None else track.span[1])
        self.check(target)
        self.check(source)
        asked, instant = instant, instant or self.latest_common(target, source)
        up, failure = self._climb(source, (target,), instant)
        down, failure_below = self._climb(target, up, instant)
        common = next(reversed(down))
        if common not in up:
            reason = failure or failure_below or self._unconnected(target, source)
            raise reason if asked else _of_latest(reason)
        return (down[common].inverse() @ up[common] if common != target else up[common]), instant

    def latest_common(self, target: str, source: str) -> int:
        """The latest instant at which all transforms between two frames are known; 0 if all of them are static.

        Raises `LookupException` or `ConnectivityException`.
        """
        self.check(target)
        self.check(source)
        newest: dict[str, int] = {}  # frame -> the earliest of the newest instants below it
        latest = 0
        for frame, instant in self._newest(source):
            newest[frame] = latest = _earlier(latest, instant)
        latest = 0
        for frame, instant in self._newest(target):
            latest = _earlier(latest, instant)
            if frame in newest:
                return _earlier(latest, newest[frame])
        raise self._unconnected(target, source)

    def check(self, frame: str) -> None:
        """Raise `InvalidArgumentException` for what cannot be a frame's name, `LookupException` for one that was never given."""
        if frame in self.names:
            return
        if not frame or frame.startswith("/"):
            raise InvalidArgumentException(
                f"{frame!r}: names of frames are not empty, and do not begin with a slash"
                + (f"; ask for {frame[1:]!r}" if frame[1:] in self.names else "")
            )
        near = did_you_mean(frame, self.names, "did", most=2, quoted=False)
        hint = near or f"there are: {', '.join(sorted(self.names)) or 'none yet'}"
        raise LookupException(f"there is no frame {frame!r}; {hint}")

    def clear(self) -> None:
        """Forget what moves; what is static stays, and so do the names."""
        for track in self._tracks.values():
            track.clear()

    def chain(self, frame: str) -> Iterator[str]:
        """`frame`, its newest parent, and so on up to its root."""
        return (each for each, _ in self._newest(frame))

    def _newest(self, frame: str) -> Iterator[tuple[str, int]]:
        """`frame` and each newest parent above it, with the newest instant of the transform below it; 0 for a static one, and for `frame`."""
        yield frame, 0
        while (track := self._tracks.get(frame)) is not None and (parent := track.parent) is not None:
            frame = parent
            yield frame, track.span[1]

    def _climb(
        self, frame: str, until: Container[str], instant: int
    ) -> tuple[dict[str, Transform], TransformException | None]:
        """Each frame from `frame` up to one of `until`, or else to the highest, with what takes points there; and why it is the highest.

        That a transform is not known at the instant is no error here: the other frame may be below.
        """
        pose = IDENTITY
        passed = {frame: pose}
        while frame not in until and (track := self._tracks.get(frame)) is not None:
            try:
                frame, step = track.at(instant)
            except ExtrapolationException as error:
                return passed, error
            if frame in passed:
                loop = " in ".join([*passed, frame])
                return passed, LookupException(f"the transforms known at {seconds(instant)} s make a loop: {loop}")
            passed[frame] = pose = step @ pose
        return passed, None

    def _refuse_loop(self, parent: str, child: str) -> None:
        chain = [child, *self.chain(parent)]
        if child in chain[1:]:
            loop = " in ".join(chain[: chain.index(child, 1) + 1])
            raise InvalidArgumentException(f"{parent} -> {child} would close a loop: {loop}")

    def _unconnected(self, target: str, source: str) -> ConnectivityException:
        roots = [[*self.chain(frame)][-1] for frame in (source, target)]
        return ConnectivityException(
            f"{source} and {target} are not connected: {source} hangs from {roots[0]}, {target} from {roots[1]}; "
            f"nobody publishes a transform between the two"
        )


def _of_latest(reason: TransformException) -> TransformException:
    """The error of a lookup without a time; waiting for more may help, although the common time is before one of the transforms."""
    if not isinstance(reason, ExtrapolationException):
        return reason
    error = type(reason)(f"there is no time at which all on the way is known: {reason}")
    error.past = False
    return error


def _earlier(a: int, b: int) -> int:
    """The earlier of two instants, of which 0 is any."""
    return min(a, b) if a and b else a or b
