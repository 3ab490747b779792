"""The gossip point: how the processes of one host find each other without a daemon, whichever starts or ends first.

Every process connects to one well-known port of the loopback interface, and tries again as long as nobody answers. The process that can bind the
port listens there with a second session, in router mode, which only tells those that connect of each other; they then link directly. When
the process that holds the port ends, the others keep their links, and one of them binds the port. A router, which the programs of ROS 2
meet by, has another port, so that it can be started and ended at any time; every process looks for it, too.
"""

from __future__ import annotations

from contextlib import suppress

from actors.transport.zenoh import objects
from actors.transport.zenoh.config import ZenohConfig, point_settings, write_config
from actors.transport.zenoh.library import import_zenoh


class GossipPoint:
    """This process's part in it. All methods may wait, and are called by one thread, one after the other.

    Invariant: at most one session of this process listens at the point; after `close` none does, and none will.
    """

    def __init__(self, config: ZenohConfig) -> None:
        self.endpoint = config.gossip_point
        self._config = config
        self._session: objects.Session | None = None
        self._closed = not self.endpoint

    @property
    def held(self) -> bool:
        """Whether this process holds the port."""
        return self._session is not None

    def hold(self) -> None:
        """Listen at the port, unless somebody does. Never raises: if it fails, others are found once somebody else holds it."""
        if self._session is None and not self._closed:
            library = import_zenoh()
            with suppress(library.ZError):  # the port is taken, which is as good
                self._session = library.open(write_config("", point_settings(self._config)))

    def close(self) -> None:
        """Give the port free."""
        self._closed = True
        session, self._session = self._session, None
        if session is not None:
            with suppress(import_zenoh().ZError):  # it could not say farewell to everybody in time
                session.close()
