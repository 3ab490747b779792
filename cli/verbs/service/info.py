"""What `service info` prints."""

from __future__ import annotations

import argparse

from cli.command import Exit
from cli.graph.view import CLIENT, SERVER
from cli.verbs.endpoints import show
from cli.verbs.service import KIND


async def info(options: argparse.Namespace) -> Exit:
    """The types and the ends of one service."""
    return await show(options, KIND, {"Clients": CLIENT, "Services": SERVER})
