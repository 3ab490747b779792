"""Monitors and links of incarnations, as in Erlang/OTP."""

from __future__ import annotations

import asyncio

from actors.supervision.child_task import ChildTask
from actors.supervision.errors import LinkBroken
from actors.supervision.reasons import Gone, is_abnormal
from actors.supervision.refs import Down


def complete_on_end(incarnation: ChildTask, future: asyncio.Future[Down]) -> None:
    """Complete `future` with the notice of the incarnation's end. The watch ends when the future is done or canceled."""

    def tell(down: Down) -> None:
        if not future.done():
            future.set_result(down)

    incarnation.watch(tell)
    future.add_done_callback(lambda _: incarnation.unwatch(tell))


def share_fate(one: ChildTask, other: ChildTask) -> None:
    """Link two incarnations: when one fails, the other is ended as failed. The link ends with the first of them that ends."""

    def one_ended(down: Down) -> None:
        other.unwatch(other_ended)
        _strike(other, down)

    def other_ended(down: Down) -> None:
        one.unwatch(one_ended)
        _strike(one, down)

    one.watch(one_ended)
    other.watch(other_ended)


def _strike(survivor: ChildTask, down: Down) -> None:
    if not isinstance(down.reason, Gone) and is_abnormal(down.reason):
        survivor.fail(LinkBroken(down), survivor.entry.spec.stop)
