"""Nodes that stand in for those that are not here."""

from __future__ import annotations

from actors.runtime.node import Node


class StandIn(Node):
    """Stands in for a node that is not here: it has its name and its parameters, whatever these are, and does nothing."""

    allow_undeclared_parameters = True
