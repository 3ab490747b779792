"""The tree of frames: every frame has one parent, and any two frames under one root can be asked for at any instant that is known.

What ROS calls a tf buffer. It knows nothing of nodes and topics: see `robot.frames.listen` for one that is fed from `/tf`.
"""

from __future__ import annotations

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.suggest import did_you_mean
from actors.time import nanoseconds_of, stamp_of
from robot.frames.track import Track
from robot.geometry.errors import Extrapolation, InvalidTransform, NotATree, NotConnected, UnknownFrame
from robot.geometry.transform import Transform

__all__ = ["HISTORY", "FrameTree"]

HISTORY = 10.0
"""For how long transforms are kept, seconds."""


class FrameTree:
    """Transforms between frames over the last `history` seconds.

    Times are `Time` messages; None asks for the latest instant at which all transforms on the way are known. Frame names are
    plain words without a leading slash, as in tf2.
    """

    def __init__(self, history: float = HISTORY) -> None:
        self._keep = round(history * 1e9)
        self._tracks: dict[str, Track] = {}
        self._names: set[str] = set()
        self.outdated = 0
        """Transforms that came later than `history` after newer ones, and were not kept."""

    def __repr__(self) -> str:
        return f"<FrameTree of {', '.join(sorted(self._names)) or 'no frames'}>"

    @property
    def frames(self) -> tuple[str, ...]:
        """The names of all frames, in alphabetical order."""
        return tuple(sorted(self._names))

    def parent(self, frame: str) -> str | None:
        """The frame in which `frame` is given; None for a root. Raises `UnknownFrame`."""
        self._check(frame)
        track = self._tracks.get(frame)
        return None if track is None else track.parent

    def insert(self, message: TransformStamped, *, static: bool = False) -> None:
        """Take in one transform: `child_frame_id` in `header.frame_id`, at the stamp, or at all times when `static`.

        Raises `InvalidTransform`, and `NotATree` for a loop or a second parent; the tree stays as it was.
        """
        parent, child = message.header.frame_id, message.child_frame_id
        if not parent or not child or parent.startswith("/") or child.startswith("/"):
            raise InvalidTransform(
                f"{parent!r} -> {child!r}: both frames need a name, and frame names do not begin with a slash"
            )
        transform = Transform.from_message(message.transform)
        track = self._tracks.get(child)
        if track is None or track.static != static or track.parent != parent:
            track = self._new_track(parent, child, static, track)
        if not track.add(nanoseconds_of(message.header.stamp), transform):
            self.outdated += 1

    def lookup(self, target: str, source: str, at: Time | None = None) -> Transform:
        """What takes points given in `source` to `target`; the pose of `source` in `target`.

        Raises `UnknownFrame`, `NotConnected`, and `Extrapolation` when a transform on the way is not known at that time.
        """
        up, down = self._way(target, source)
        instant = self._latest((*up, *down)) if at is None else nanoseconds_of(at)
        return _climb(down, instant).inverse() @ _climb(up, instant)

    def latest(self, target: str, source: str) -> Time | None:
        """The instant that `lookup` without a time answers for; None when only static transforms lie between. Raises as `lookup`."""
        up, down = self._way(target, source)
        tracks = [track for track in (*up, *down) if not track.static]
        return stamp_of(self._latest(tracks)) if tracks else None

    def clear(self) -> None:
        """Forget what moves; what is static stays. For a clock that was set back."""
        self._tracks = {child: track for child, track in self._tracks.items() if track.static}
        self._names = {name for track in self._tracks.values() for name in (track.parent, track.child)}

    def _new_track(self, parent: str, child: str, static: bool, old: Track | None) -> Track:
        if old is not None and old.parent != parent:
            raise NotATree(
                f"{parent} -> {child}: {child} is given in {old.parent} already, and a frame has one parent; "
                "stop one of the two broadcasters, or give its frame another name"
            )
        above: str | None = parent
        chain = [child]
        while above is not None:
            chain.append(above)
            if above == child:
                raise NotATree(f"{parent} -> {child} would close a loop: {' in '.join(chain)}")
            track = self._tracks.get(above)
            above = None if track is None else track.parent
        made = self._tracks[child] = Track(parent, child, self._keep, static=static)
        self._names |= {parent, child}
        return made

    def _check(self, frame: str) -> None:
        if frame not in self._names:
            near = did_you_mean(frame, self._names, "did", most=2, quoted=False)
            hint = near or f"there are: {', '.join(self.frames) or 'none yet'}"
            raise UnknownFrame(f"there is no frame {frame!r}; {hint}")

    def _chain(self, frame: str) -> list[Track]:
        """The tracks from `frame` up to its root."""
        chain: list[Track] = []
        while (track := self._tracks.get(frame)) is not None:
            chain.append(track)
            frame = track.parent
        return chain

    def _way(self, target: str, source: str) -> tuple[list[Track], list[Track]]:
        """From `source` up to the first common frame, and from `target` up to it."""
        self._check(target)
        self._check(source)
        up, down = self._chain(source), self._chain(target)
        while up and down and up[-1] is down[-1]:
            up.pop()
            down.pop()
        roots = (up[-1].parent if up else source, down[-1].parent if down else target)
        if roots[0] != roots[1]:
            raise NotConnected(
                f"{source} and {target} are not connected: {source} hangs from {roots[0]}, {target} from {roots[1]}; "
                f"nobody publishes a transform between the two"
            )
        return up, down

    def _latest(self, tracks: tuple[Track, ...] | list[Track]) -> int:
        """The latest instant at which all are known; 0 when none moves. Raises `Extrapolation` when their spans do not meet."""
        moving = [track for track in tracks if not track.static]
        if not moving:
            return 0
        newest = min(track.span[1] for track in moving)
        late = max(moving, key=lambda track: track.span[0])
        if late.span[0] > newest:
            old = min(moving, key=lambda track: track.span[1])
            raise Extrapolation(
                f"there is no instant at which all is known: {old.parent} -> {old.child} ends at {newest * 1e-9:.6f} s, "
                f"{late.parent} -> {late.child} begins at {late.span[0] * 1e-9:.6f} s"
            )
        return newest


def _climb(way: list[Track], instant: int) -> Transform:
    """From the frame where the way begins to the one where it ends."""
    pose = Transform()
    for track in way:
        pose = track.at(instant) @ pose
    return pose
