"""Supervision as in Erlang/OTP: trees declared as values, and run on raw asyncio tasks.

Users write trees with `child` and `declarations` and the options in `policy`, and get the values in `reasons`, `refs`, `report` and
`errors`. What trees are made of are names of `actors`; the names here are the reasons of an end, and the options of `auto_shutdown`. A
system runs trees with `running`, and provides what `peers` asks for.

How it works: an event (`events`) is first recorded in the state of the supervisor (`children`, with `entry` and `steps`).
`decide` then says what follows from the event (for requests: `administer`), as a sequence of `acts`, and `executor` carries them out.
`child_task` owns the task of one life of a child. `decide` is pure: it needs no event loop, and its tests are a table of cases.
"""

from __future__ import annotations

from actors.supervision.policy import all_significant, any_significant, never
from actors.supervision.reasons import Failed, Killed, Leaked, Returned, Stopped

__all__ = ["Failed", "Killed", "Leaked", "Returned", "Stopped", "all_significant", "any_significant", "never"]
