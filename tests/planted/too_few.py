"""Two nodes that may fail, and one restart allowed for both: the intensity is declared too low."""

from __future__ import annotations

from actors import Child, Intensity, Node, Supervisor, every


class Base(Node):
    @every(hz=5)
    def work(self) -> None:
        self.log.debug("at work")


def bases(restarts: int) -> Supervisor:
    children = [Child(Base, name=name) for name in ("base_a", "base_b", "base_c")]
    return Supervisor("bases", intensity=Intensity(restarts, within=10.0), children=children)


def tree() -> Supervisor:
    return bases(1)


def healthy() -> Supervisor:
    """As many as there may be at a time."""
    return bases(2)
