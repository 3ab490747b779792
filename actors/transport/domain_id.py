"""The number of the domain that ROS_DOMAIN_ID asks for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

MOST_DOMAIN: Final = 232
"""The highest number of a domain in ROS 2."""


def domain_from_environment(environment: Mapping[str, str]) -> int:
    """ROS_DOMAIN_ID, 0 if it is not set. Raises ValueError if it is no number of a domain."""
    text = environment.get("ROS_DOMAIN_ID", "") or "0"
    if not (text.isascii() and text.isdigit() and int(text) <= MOST_DOMAIN):
        raise ValueError(f"ROS_DOMAIN_ID={text!r}: a domain is a number from 0 to {MOST_DOMAIN}")
    return int(text)
