"""`bag play` and `bag burst`: publish what was recorded."""

from __future__ import annotations

import argparse
import asyncio
import math
import sys
from dataclasses import replace
from typing import Any, Literal

from actors import Child, temporary
from actors.bag import BagReader, Player, PlayOptions
from cli.command import CommandFailed
from cli.graph.seen import seen
from cli.graph.types import learn_folders
from cli.verbs.bag.keys import keys
from cli.verbs.bag.options import complain_of_absent, profiles, selection_of
from cli.verbs.bag.progress import progress, progress_over
from cli.verbs.bag.record import show


async def play(options: argparse.Namespace) -> int:
    """Play a bag to its end, or as many messages as `bag burst` asks for; the exit code."""
    learn_folders(options)
    told = _told(options)
    with BagReader(options.bag_path) as bag:  # so that a bag that is none is said before anything else happens
        complain_of_absent(told.selection, bag)
    return await _play(options, told, getattr(options, "num_messages", None))


def _told(options: argparse.Namespace) -> PlayOptions:
    """The options of the player. Raises `CommandFailed`."""
    common: dict[str, Any] = {
        "selection": selection_of(options),
        "start_offset": options.start_offset,
        "remap": dict(_rule(rule) for rule in options.remap),
        "qos": profiles(options.qos_profile_overrides_path),
        "read_ahead": max(1, options.read_ahead_queue_size),
    }
    if not hasattr(options, "rate"):
        return PlayOptions(paused=True, **common)
    until_ns = options.playback_until_nsec
    if options.playback_until_sec >= 0:
        until_ns = round(min(options.playback_until_sec, 4e9) * 1e9)  # nobody plays beyond 2096
    source: Literal["service", "client"] = "service"
    if options.service_requests_source == "client_introspection":
        source = "client"
    return PlayOptions(
        rate=options.rate,
        loop=options.loop,
        delay=options.delay,
        duration=options.playback_duration if options.playback_duration >= 0 else math.inf,
        until_ns=until_ns if until_ns >= 0 else None,
        paused=options.start_paused,
        clock_hz=options.clock,
        clock_topics=None if options.clock_topics_all else frozenset(options.clock_topics),
        service_requests=source if options.publish_service_requests else "",
        **common,
    )


def _rule(rule: str) -> tuple[str, str]:
    old, found, new = rule.partition(":=")
    if not (found and old and new):
        raise CommandFailed(f"--remap {rule!r}: write it as OLD:=NEW")
    return f"/{old.removeprefix('/')}", f"/{new.removeprefix('/')}"


async def _play(options: argparse.Namespace, told: PlayOptions, burst: int | None) -> int:
    async with seen(options) as graph:
        graph.system.observe(lines=show)
        await graph.system.join(Child(Player, args=(options.bag_path, replace(told, paused=True)), restart=temporary))
        player = graph.system.node(Player)
        await graph.settle(options.spin_time)  # so that the first messages reach those who wait for them
        if not told.paused:
            player.unpause()
        if burst is not None:
            print(f"{await player.burst(burst)} messages played", file=sys.stderr)
        with keys(player, wanted=not options.disable_keyboard_controls):
            try:
                await _watched(player)
            finally:  # a signal may have ended it
                progress_over()
                if player.failure is None:
                    print(f"{player.played} messages played", file=sys.stderr)
        if player.failure is not None:
            raise player.failure
    return 0


async def _watched(player: Player) -> None:
    while True:
        try:
            async with asyncio.timeout(0.5):
                return await player.wait()
        except TimeoutError:
            at = (player.position_ns - player.bag.metadata.start_ns) / 1e9
            whole = player.bag.metadata.duration_ns / 1e9
            progress(f"{at:.1f} s of {whole:.1f} s, rate {player.rate:g}{', paused' if player.paused else ''}")
