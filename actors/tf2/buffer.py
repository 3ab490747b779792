"""`Buffer`: transforms between frames over the last seconds, asked for by name and time."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import TypeVar

from actors.contracts.contracts import Service
from actors.interfaces.geometry_msgs.msg import TransformStamped, VelocityStamped
from actors.interfaces.message import M
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.tf2_msgs.srv import FrameGraph, FrameGraph_Request, FrameGraph_Response
from actors.runtime.node import Node
from actors.tf2 import description
from actors.tf2.description import Frame
from actors.tf2.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TransformException,
)
from actors.tf2.frame_tree import FrameTree
from actors.tf2.geometry import do_transform
from actors.tf2.lookups import WAIT, AsyncLookups, Instant, header_of, instant_asked, refuse_wait, seconds_of
from actors.tf2.quaternions import Triple
from actors.tf2.transform import Transform, stamped, velocity_in
from actors.time.deadlines import check_timeout
from actors.time.values import ClockType, Duration, Time, nanoseconds_of, stamp_of
from actors.waiting import Waiters

T = TypeVar("T")

FRAMES = Service(FrameGraph, "tf2_frames")
"""All frames of a buffer as YAML, which `view_frames` of ROS 2 reads."""

CACHE_TIME = 10.0
"""The default of how long transforms are kept, seconds."""
AVERAGED = 0.1
"""The default of the time over which a velocity is averaged, seconds."""


class Buffer(AsyncLookups):
    """Transforms between frames over the last `cache_time` seconds, or `Duration`.

    Between two transforms of a frame it interpolates: linearly in place, by slerp in rotation. It never extrapolates. If it is given a
    `node`, that node serves `tf2_frames`.

    Frames are named by plain words; a leading slash of a transform that comes in is removed. Of all methods that take `target_frame` and
    `source_frame`, the answer takes points given in the source frame to the target frame. They raise

    - `LookupException` for an unknown frame,
    - `ConnectivityException` if no chain of transforms connects the two,
    - an `ExtrapolationException` if a transform on the way is not known at that time,
    - `InvalidArgumentException` for a name that is empty or begins with a slash.
    """

    # Invariant: who waits for a transform is woken, and the listeners are called, after every change of the tree.

    def __init__(self, cache_time: float | Duration = CACHE_TIME, node: Node | None = None) -> None:
        keep = cache_time.nanoseconds if isinstance(cache_time, Duration) else round(cache_time * 1e9)
        if keep <= 0:
            raise ValueError(f"Buffer(cache_time={cache_time!r}): transforms must be kept for a time above 0")
        self._tree = FrameTree(keep)
        self._waiters = Waiters()
        self._listeners: list[Callable[[], object]] = []
        if node is not None:
            node.serve(FRAMES, self._tell_frames)

    def __repr__(self) -> str:
        return f"<Buffer of {', '.join(self.all_frame_names()) or 'no frames'}>"

    # -- what comes in ------------------------------------------------------------------------------------------------------

    def set_transform(self, transform: TransformStamped, authority: str = "default_authority") -> bool:
        """Take in a transform: ``child_frame_id`` in ``header.frame_id`` at the stamp. `authority` says who told it.

        Returns False if it is older than what is kept. Raises `InvalidArgumentException` for a transform that cannot be, or that would
        close a loop of frames; then the buffer stays as it was.
        """
        return self._set(transform, authority, static=False)

    def set_transform_static(self, transform: TransformStamped, authority: str = "default_authority") -> None:
        """Take in a transform that holds at all times; it replaces the frame's older ones. Raises as `set_transform`."""
        self._set(transform, authority, static=True)

    def clear(self) -> None:
        """Forget what moves; what is static stays. For a clock that was set back."""
        self._tree.clear()
        self._changed()

    def on_change(self, listener: Callable[[], object]) -> Callable[[], None]:
        """Call `listener` after each transform that was taken in, and after `clear`. Returns a function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def _set(self, message: TransformStamped, authority: str, *, static: bool) -> bool:
        parent, child, stamp = message.header.frame_id, message.child_frame_id, message.header.stamp
        try:
            transform = Transform.from_msg(message)
        except InvalidArgumentException as error:
            raise InvalidArgumentException(f"{parent} -> {child} (by {authority}): {error}") from None
        instant = nanoseconds_of(stamp)
        kept = self._tree.insert(parent, child, instant, transform, static=static, authority=authority)
        if kept:
            self._changed()
        return kept

    def _changed(self) -> None:
        self._waiters.wake_all()
        for listener in tuple(self._listeners):
            listener()

    # -- lookup -------------------------------------------------------------------------------------------------------------

    def lookup_transform(
        self, target_frame: str, source_frame: str, time: Instant = None, timeout: None = None
    ) -> TransformStamped:
        """The transform from what has arrived until now; its stamp is the time it is of, 0 if all on the way is static.

        Nothing here waits: what is given as a `timeout` raises ``TypeError``, which names the method that does.
        """
        refuse_wait("lookup_transform", timeout)
        transform, instant = self._tree.lookup(target_frame, source_frame, instant_asked(time))
        return stamped(target_frame, source_frame, transform, stamp_of(instant))

    def lookup_transform_full(
        self,
        target_frame: str,
        target_time: Instant,
        source_frame: str,
        source_time: Instant,
        fixed_frame: str,
        timeout: None = None,
    ) -> TransformStamped:
        """Where the source frame was at one time, seen from where the target frame is at another.

        `fixed_frame` is the frame that did not move in between, such as "odom" or "map". The stamp of the answer is the target time.
        A `timeout` raises, as with `lookup_transform`.
        """
        refuse_wait("lookup_transform_full", timeout)
        for frame in (target_frame, source_frame, fixed_frame):
            self._tree.check(frame)
        fixed_from_source, _ = self._tree.lookup(fixed_frame, source_frame, instant_asked(source_time))
        target_from_fixed, instant = self._tree.lookup(target_frame, fixed_frame, instant_asked(target_time))
        return stamped(target_frame, source_frame, target_from_fixed @ fixed_from_source, stamp_of(instant))

    def can_transform(self, target_frame: str, source_frame: str, time: Instant = None, timeout: None = None) -> bool:
        """Whether `lookup_transform` has an answer now; its error says why not. A `timeout` raises, as there."""
        refuse_wait("can_transform", timeout)
        return _succeeds(lambda: self.lookup_transform(target_frame, source_frame, time))

    def can_transform_full(
        self,
        target_frame: str,
        target_time: Instant,
        source_frame: str,
        source_time: Instant,
        fixed_frame: str,
        timeout: None = None,
    ) -> bool:
        """Whether `lookup_transform_full` has an answer now. A `timeout` raises, as with `lookup_transform`."""
        refuse_wait("can_transform_full", timeout)
        return _succeeds(
            lambda: self.lookup_transform_full(target_frame, target_time, source_frame, source_time, fixed_frame)
        )

    def transform(self, message: M, target_frame: str, timeout: None = None) -> M:
        """A message with a header, as `do_transform` knows them, given in another frame at its stamp. Raises ``TypeError`` for others.

        A `timeout` raises, as with `lookup_transform`.
        """
        refuse_wait("transform", timeout)
        header = header_of(message)
        return do_transform(message, self.lookup_transform(target_frame, header.frame_id, header.stamp))

    def transform_full(
        self, message: M, target_frame: str, target_time: Instant, fixed_frame: str, timeout: None = None
    ) -> M:
        """As `transform`, but seen from where the target frame is at another time, as `lookup_transform_full` does."""
        refuse_wait("transform_full", timeout)
        header = header_of(message)
        there = self.lookup_transform_full(target_frame, target_time, header.frame_id, header.stamp, fixed_frame)
        return do_transform(message, there)

    def lookup_velocity(
        self,
        tracking_frame: str,
        observation_frame: str,
        time: Instant = None,
        averaging_interval: float | Duration = AVERAGED,
        *,
        reference_frame: str | None = None,
        reference_point: Triple = (0.0, 0.0, 0.0),
        reference_point_frame: str | None = None,
    ) -> VelocityStamped:
        """How a body moves that `tracking_frame` is fixed to, seen from `observation_frame`: rad/s, and m/s of one of its points.

        That point is where `reference_point` of `reference_point_frame` is; by default the origin of the reference frame, as in tf2. With
        ``reference_point_frame=tracking_frame`` it is the origin of the tracking frame, which most people mean. The axes are those of the
        `reference_frame`, by default the observation frame.

        It is the mean over `averaging_interval`, seconds or a `Duration`, about `time`, or up to what is known if that is less; the stamp
        is the middle. Raises as `lookup_transform` does, and `InvalidArgumentException` for an interval that is not above 0.
        """
        reference = observation_frame if reference_frame is None else reference_frame
        point_frame = reference if reference_point_frame is None else reference_point_frame
        span = round(seconds_of(averaging_interval) * 1e9)
        if span <= 0:
            raise InvalidArgumentException(
                f"averaging_interval={averaging_interval!r}: a velocity needs a time above 0"
            )
        newest = self._tree.latest_common(observation_frame, tracking_frame)
        instant = instant_asked(time) or newest
        end = min(instant + span // 2, newest) if newest else instant + span  # without one, nothing moves
        start = max(end - span, 1)  # 0 would be the newest again

        def there(target: str, source: str, at: int) -> Transform:
            return self._tree.lookup(target, source, at)[0]

        return velocity_in(
            VelocityStamped(
                header=Header(frame_id=reference, stamp=stamp_of((start + end) // 2)),
                body_frame_id=tracking_frame,
                reference_frame_id=observation_frame,
            ),
            before=there(observation_frame, tracking_frame, start),
            after=there(observation_frame, tracking_frame, end),
            seconds=(end - start) * 1e-9,
            now=there(observation_frame, tracking_frame, instant),
            point=there(observation_frame, point_frame, instant).point(reference_point),
            axes=there(reference, observation_frame, instant),
        )

    def get_latest_common_time(self, target_frame: str, source_frame: str) -> Time:
        """The time that `lookup_transform` without a time answers for; 0 if all on the way is static."""
        latest = self._tree.latest_common(target_frame, source_frame)
        return Time(nanoseconds=latest, clock_type=ClockType.ROS_TIME)

    # -- lookup that waits --------------------------------------------------------------------------------------------------

    async def lookup_transform_async(
        self, target_frame: str, source_frame: str, time: Instant = None, *, timeout: float | Duration | None = WAIT
    ) -> TransformStamped:
        """As `lookup_transform`, but wait up to `timeout` for what has not come yet; then raise what that raises.

        The timeout, seconds or a `Duration`, is on the event loop's clock; None waits without end. A time before everything that is kept
        raises at once. A plain handler that waits here holds up its node; goals, tasks and handlers with ``concurrent=`` do not.
        """
        return await self._wait(lambda: self.lookup_transform(target_frame, source_frame, time), timeout)

    async def lookup_transform_full_async(
        self,
        target_frame: str,
        target_time: Instant,
        source_frame: str,
        source_time: Instant,
        fixed_frame: str,
        *,
        timeout: float | Duration | None = WAIT,
    ) -> TransformStamped:
        """As `lookup_transform_full`, but wait as `lookup_transform_async` does."""
        return await self._wait(
            lambda: self.lookup_transform_full(target_frame, target_time, source_frame, source_time, fixed_frame),
            timeout,
        )

    wait_for_transform_async = lookup_transform_async
    """The name of tf2_ros for a future of the same."""
    wait_for_transform_full_async = lookup_transform_full_async
    """The name of tf2_ros for a future of the same."""

    async def _wait(self, lookup: Callable[[], T], timeout: float | Duration | None) -> T:
        end: float | None = None
        if timeout is not None:
            check_timeout("a lookup of a transform", seconds := seconds_of(timeout))
            end = asyncio.get_running_loop().time() + seconds
        while True:
            try:
                return lookup()
            except (LookupException, ConnectivityException, ExtrapolationException) as error:
                if isinstance(error, ExtrapolationException) and error.past:
                    raise
                try:
                    async with asyncio.timeout_at(end):
                        await self._waiters.wait()
                except TimeoutError:
                    raise error from None

    # -- what is there ------------------------------------------------------------------------------------------------------

    def all_frame_names(self) -> tuple[str, ...]:
        """The names of all frames, in alphabetical order."""
        return tuple(sorted(self._tree.names))

    def frames(self) -> Mapping[str, Frame]:
        """Each frame that has a parent now: its parent, who told it, and which time is known."""
        return description.frames(self._tree.tracks)

    def all_frames_as_yaml(self) -> str:
        """All frames as a YAML document with the fields that tf2 gives."""
        return description.as_yaml(self.frames())

    def all_frames_as_string(self) -> str:
        """All frames as text, a line each."""
        return description.as_text(self.frames())

    async def _tell_frames(self, request: FrameGraph_Request) -> FrameGraph_Response:
        return FrameGraph.Response(frame_yaml=self.all_frames_as_yaml())


def _succeeds(lookup: Callable[[], object]) -> bool:
    try:
        lookup()
    except TransformException:
        return False
    return True
