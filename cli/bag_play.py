"""`bag play` and `bag burst`: publish what was recorded."""

from __future__ import annotations

import argparse
import asyncio
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from actors import Child, temporary
from actors.bag import BagReader, Player, PlayOptions
from cli.bag import progress, progress_over
from cli.bag_keys import keys
from cli.bag_options import add_selection, not_negative, positive, profiles, selection_of, with_types
from cli.bag_record import show
from cli.bag_signals import until_signal
from cli.command import CommandFailed, Exit
from cli.graph import add_graph_options, seen

__all__ = ["run"]


def run(verb: str, argv: Sequence[str]) -> int:
    """Play a bag to its end; the exit code."""
    options = with_types(_parser(verb), argv)
    told = _told(options)
    with BagReader(options.bag_path):
        pass  # so that a bag that is none is said before anything else happens
    return asyncio.run(_play(options, told, options.num_messages if verb == "burst" else None))


def _parser(verb: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog=f"python -m robot bag {verb}", description="Publish what was recorded.")
    parser.add_argument("bag_path", type=Path, help="the folder of a bag, or one of its files")
    parser.add_argument("-s", "--storage", choices=("mcap", "sqlite3"), help="accepted for ros2's sake: it is seen")
    add_selection(parser, "play", everything=True)
    group = parser.add_argument_group("playing")
    group.add_argument(
        "--start-offset", type=not_negative, default=0.0, metavar="S", help="begin S seconds into the bag"
    )
    group.add_argument("-m", "--remap", nargs="+", default=[], metavar="RULE", help="OLD:=NEW: play under another name")
    group.add_argument(
        "--qos-profile-overrides-path", type=Path, metavar="FILE", help="what to offer, by topic, in YAML"
    )
    group.add_argument(
        "--read-ahead-queue-size", type=int, default=1000, metavar="N", help="messages read at once (1000)"
    )
    group.add_argument("--disable-keyboard-controls", action="store_true", help="do not listen to keys")
    if verb == "burst":
        group.add_argument("-n", "--num-messages", type=int, default=0, metavar="N", help="how many; 0: all")
    else:
        _add_play(parser, group)
    add_graph_options(parser)
    return parser


def _add_play(parser: argparse.ArgumentParser, group: Any) -> None:
    group.add_argument("-r", "--rate", type=positive, default=1.0, help="how much faster than recorded (1.0)")
    group.add_argument("-l", "--loop", action="store_true", help="begin anew at the end")
    group.add_argument(
        "-d",
        "--delay",
        type=not_negative,
        default=0.0,
        metavar="S",
        help="wait S seconds before playing, and /clock with it",
    )
    group.add_argument("-p", "--start-paused", action="store_true", help="begin paused")
    group.add_argument("--playback-duration", type=float, default=-1.0, metavar="S", help="play S seconds of the bag")
    until = parser.add_mutually_exclusive_group()
    until.add_argument("--playback-until-sec", type=float, default=-1.0, metavar="S", help="play until this time")
    until.add_argument("--playback-until-nsec", type=int, default=-1, metavar="NS", help="the same in nanoseconds")
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--clock", type=positive, nargs="?", const=40.0, default=0.0, metavar="HZ", help="publish /clock, at HZ (40)"
    )
    clock.add_argument(
        "--clock-topics", nargs="+", default=[], metavar="TOPIC", help="publish it before messages of these"
    )
    clock.add_argument("--clock-topics-all", action="store_true", help="publish it before every message")
    group.add_argument(
        "--wait-for-all-acked",
        type=not_negative,
        metavar="MS",
        help="accepted for ros2's sake: all is sent before the end",
    )
    group.add_argument(
        "--publish-service-requests",
        action="store_true",
        help="send requests and goals, instead of the events of services",
    )
    group.add_argument(
        "--service-requests-source", choices=("service_introspection", "client_introspection"),
        default="service_introspection", metavar="SOURCE",
        help="whose record of them: service_introspection (that of the server), or client_introspection",
    )  # fmt: skip
    group.add_argument("--disable-loan-message", action="store_true", help="accepted for ros2's sake")


def _told(options: argparse.Namespace) -> PlayOptions:
    """What the player is told. Raises `CommandFailed`."""
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
        until_ns = round(options.playback_until_sec * 1e9)
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
            signaled = await until_signal(_watched(player))
        progress_over()
        if player.failure is not None:
            raise player.failure
        print(f"{player.played} messages played", file=sys.stderr)
    return 0 if signaled is None else Exit.by(signaled).value[0]


async def _watched(player: Player) -> None:
    while True:
        try:
            async with asyncio.timeout(0.5):
                return await player.wait()
        except TimeoutError:
            at = (player.position_ns - player.bag.metadata.start_ns) / 1e9
            whole = player.bag.metadata.duration_ns / 1e9
            progress(f"{at:.1f} s of {whole:.1f} s, rate {player.rate:g}{', paused' if player.paused else ''}")
