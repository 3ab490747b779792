"""Starting systems from a program: trees, command-line arguments, signals, `run`, `open_node` and `execute`."""

from __future__ import annotations

from actors.running.arguments import remove_ros_args

__all__ = ["remove_ros_args"]
