"""Lifecycle nodes (managed nodes), by the rules of ROS 2: their states, and how a whole system is brought up and down.

`LifecycleNode` itself is a name of `actors`.
"""

from __future__ import annotations

from actors.lifecycle.machine import HookResult, LifecycleState, TransitionRefused
from actors.lifecycle.node import bring_down, bring_up

__all__ = ["HookResult", "LifecycleState", "TransitionRefused", "bring_down", "bring_up"]
