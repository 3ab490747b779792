"""Replay: the journal of a node or of a subtree, and its replay into that alone. See docs/howto/replay.md."""

from actors.replay.comparison import Difference
from actors.replay.errors import NoJournal, ReplayError
from actors.replay.journal import Journal
from actors.replay.play import Verdict, load, replay
from actors.replay.publishing import has_journal, journals_in, recording_in, recordings_in
from actors.replay.recording import Recording

__all__ = [
    "Difference",
    "Journal",
    "NoJournal",
    "Recording",
    "ReplayError",
    "Verdict",
    "has_journal",
    "journals_in",
    "load",
    "recording_in",
    "recordings_in",
    "replay",
]
