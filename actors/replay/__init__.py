"""Replay: the journal of a node or of a subtree, and its replay into that alone. See docs/howto/replay.md."""

from actors.replay.comparison import Difference
from actors.replay.errors import NoJournal, ReplayError
from actors.replay.journal import Journal
from actors.replay.play import Verdict, load, replay
from actors.replay.publishing import has_journal, journals_in, tape_in, tapes_in
from actors.replay.tape import Tape

__all__ = [
    "Difference",
    "Journal",
    "NoJournal",
    "ReplayError",
    "Tape",
    "Verdict",
    "has_journal",
    "journals_in",
    "load",
    "replay",
    "tape_in",
    "tapes_in",
]
