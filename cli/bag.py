"""`bag VERB`: recordings, in the format and with the flags of `ros2 bag`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from types import MappingProxyType

from cli.command import CommandFailed
from cli.output import control

__all__ = ["VERBS", "main"]

VERBS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "record": ("bag_record", "record topics, services and actions"),
        "play": ("bag_play", "publish what was recorded"),
        "burst": ("bag_play", "publish some messages at once, then wait"),
        "replay": ("bag_replay", "play the journal of one node to that node alone"),
        "info": ("bag_info", "what a bag holds"),
        "echo": ("bag_echo", "print the messages of a bag, as YAML or JSON"),
        "convert": ("bag_rewrite", "write a bag anew, with other settings"),
        "filter": ("bag_rewrite", "write some of a bag: by topic, by time"),
        "merge": ("bag_rewrite", "write several bags into one"),
        "reindex": ("bag_rewrite", "write metadata.yaml anew"),
        "recover": ("bag_rewrite", "write what can be read of a bag that was cut"),
        "list": ("bag_info", "the storages and compressions there are"),
    }
)
"""Each verb with the module that runs it, and a line of help."""


def main(argv: Sequence[str]) -> int:
    """Run one verb of the group; the exit code."""
    verbs = "\n".join(f"  {verb:<9} {line}" for verb, (_, line) in VERBS.items())
    parser = argparse.ArgumentParser(
        prog="python -m robot bag",
        usage="python -m robot bag VERB ...",
        description=f"Recordings, as those of ros2 bag.\n\nverbs:\n{verbs}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("verb", choices=VERBS, metavar="VERB", help="what to do; VERB --help tells how")
    options = parser.parse_args(argv[:1])
    module = import_module(f"cli.{VERBS[options.verb][0]}")
    from actors.bag import BagError
    from actors.qos import InvalidQoS
    from actors.replay import ReplayError

    try:
        return int(module.run(options.verb, argv[1:]))
    except (BagError, InvalidQoS, ReplayError) as error:
        raise CommandFailed(str(error)) from error
    except BrokenPipeError:
        raise
    except OSError as error:
        raise CommandFailed(str(error)) from error


def progress(text: str) -> None:
    """Show how far a command is, on a terminal only."""
    if sys.stderr.isatty():
        control("\r", sys.stderr)
        print(text, end="", file=sys.stderr)
        control("\x1b[K", sys.stderr)
        sys.stderr.flush()


def progress_over() -> None:
    """Leave the line of `progress`."""
    if sys.stderr.isatty():
        control("\r\x1b[K", sys.stderr)
