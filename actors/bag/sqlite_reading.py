"""Reading the sqlite3 files of rosbag2, of any version."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Container, Generator, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actors.bag.contents import BagError, BagMessage, BagTopic, Newest
from actors.bag.metadata import NOTE, BagFile, BagMetadata

if TYPE_CHECKING:
    from actors.bag.mcap_reading import Salvage

ROWS: Final = "SELECT id, topic_id, timestamp, data FROM messages WHERE id >= ? ORDER BY id"
DAMAGE: Final = (sqlite3.Error, OverflowError, TypeError, ValueError)
"""What reading a damaged file raises: also for a text, in an error of sqlite3 too, that is not in UTF-8."""

LAST: Final = 2**63 - 1
"""The largest number of a row."""


class SqliteReading:
    """One sqlite3 file of a bag. It is opened anew for each pass over its messages. Bags of older versions hold no definitions."""

    cut = False

    def __init__(self, path: Path, shown: Path | None = None) -> None:
        self.path = path
        self._shown = shown or path
        """What the file is called in errors."""
        self._count = 0
        """How many messages there were when `metadata` counted them."""
        try:
            with closing(self._open()) as database:
                self._topics = dict(_topics(database))
                self.told = _told(database)
        except DAMAGE as error:
            raise BagError(f"{self._shown} is no sqlite3 file of a bag: {error}") from error

    def complete(self, completed: Callable[[BagTopic], BagTopic]) -> None:
        """Let topics be called from now on as others know them better."""
        self._topics = {number: completed(topic) for number, topic in self._topics.items()}

    def metadata(self) -> BagMetadata:
        """What the file holds."""
        with self._checked() as database:
            counts = dict(_all(database, "SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id"))
            (times,) = _all(database, "SELECT MIN(timestamp), MAX(timestamp) FROM messages")
            if not all(isinstance(time, int) for time in times) and times != (None, None):
                raise sqlite3.DatabaseError("a message has no time")
            start, end = times[0] or 0, times[1] or 0
        self._count = sum(counts.values())
        topics = dict[BagTopic, int]()
        for number, topic in self._topics.items():
            topics[topic] = topics.get(topic, 0) + counts.get(number, 0)
        file = BagFile(self.path.name, start, end - start, sum(topics.values()))
        return BagMetadata(storage="sqlite3", topics=topics, files=(file,), ros_distro="")

    def messages(self, start_ns: int, topics: Container[str] | None) -> Iterator[BagMessage]:
        """The messages received from `start_ns` on, in order of receipt, of these topics or all. Raises `BagError` for what is damaged."""
        query = "SELECT topic_id, timestamp, data FROM messages WHERE timestamp >= ? ORDER BY timestamp, id"
        with self._checked() as database:
            found = 0
            for number, time, data in database.execute(query, (start_ns,)):
                found += 1
                topic = self._topics.get(number)
                if topic is not None and isinstance(data, bytes) and isinstance(time, int):
                    if topics is None or topic.name in topics:
                        yield BagMessage(topic, data, time, time)
                else:
                    raise sqlite3.DatabaseError("a message has no topic, no time or no data")
            if not start_ns and found < self._count:  # the index and the table do not agree
                raise sqlite3.DatabaseError(f"it holds {self._count} messages, and {found} are found by their times")

    def before(self, end_ns: int, newest: Newest, file: int) -> None:
        """Add the messages received before `end_ns` that may be the newest of their topics."""
        query = (
            "SELECT id, timestamp, data FROM messages WHERE topic_id = ? AND timestamp < ? "
            "ORDER BY timestamp DESC, id DESC LIMIT ?"
        )
        with self._checked() as database:
            for number, topic in self._topics.items():
                wanted = newest.counts.get(topic.name, 0)
                for id, time, data in database.execute(query, (number, end_ns, wanted)):
                    newest.add(BagMessage(topic, data, time, time), (file, id, 0))

    def salvage(self, found: Salvage) -> Iterator[BagMessage]:
        """Every message that can be read, in the order of the file; `found` tells afterwards what could not."""
        found.complete = True
        at = 0
        with closing(self._open()) as database:
            while True:
                try:
                    for number, topic_id, time, data in database.execute(ROWS, (at,)):
                        at = number + 1
                        topic = self._topics.get(topic_id)
                        if topic is not None and isinstance(data, bytes) and isinstance(time, int):
                            found.messages += 1
                            yield BagMessage(topic, data, time, time)
                        else:
                            found.damaged += 1
                    return
                except DAMAGE:  # a page is damaged
                    found.damaged += 1
                    following = _readable(database, at)
                    if following is None:
                        return
                    at = following

    @contextmanager
    def _checked(self) -> Generator[sqlite3.Connection]:
        """The file, opened. What is damaged raises `BagError`."""
        try:
            with closing(self._open()) as database:
                yield database
        except DAMAGE as error:
            raise BagError(
                f"{self._shown} is damaged: {error}; `bag recover {self._shown} -o NEW` writes what can be read"
            ) from error

    def _open(self) -> sqlite3.Connection:
        if not self.path.is_file():
            raise BagError(f"{self._shown}: there is no such file")
        return sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro", uri=True, check_same_thread=False)


def _readable(database: sqlite3.Connection, after: int) -> int | None:
    """The first number of a row from which on rows can be read, after one from which they cannot; None if there is none."""

    def reads(number: int) -> bool:
        try:
            _all(database, f"{ROWS} LIMIT 1", (number,))
        except DAMAGE:
            return False
        return True

    step = 1
    while not reads(min(after + step, LAST)):
        if after + step >= LAST:
            return None
        step *= 2
    bad, good = after + step // 2, min(after + step, LAST)
    while good - bad > 1:
        middle = (bad + good) // 2
        bad, good = (bad, middle) if reads(middle) else (middle, good)
    return good


def _told(database: sqlite3.Connection) -> dict[str, str]:
    """What rosbag2 has noted in the file."""
    if not _all(database, "SELECT name FROM sqlite_master WHERE name = 'metadata'"):
        return {}
    rows = _all(database, "SELECT metadata FROM metadata ORDER BY id")
    return {NOTE: str(rows[-1][0])} if rows else {}


def _topics(database: sqlite3.Connection) -> Iterator[tuple[int, BagTopic]]:
    columns = {row[1] for row in _all(database, "PRAGMA table_info(topics)")}
    qos = "offered_qos_profiles" if "offered_qos_profiles" in columns else "''"
    digest = "type_description_hash" if "type_description_hash" in columns else "''"
    definitions: dict[str, tuple[str, str]] = {}
    if _all(database, "SELECT name FROM sqlite_master WHERE name = 'message_definitions'"):
        rows = _all(database, "SELECT topic_type, encoded_message_definition, encoding FROM message_definitions")
        definitions = {kind: (text, encoding) for kind, text, encoding in rows}
    listed = _all(database, f"SELECT id, name, type, serialization_format, {qos}, {digest} FROM topics")
    for number, name, kind, serialization, profiles, hashed in listed:
        schema, encoding = definitions.get(kind, ("", ""))
        yield (
            number,
            BagTopic(
                str(name),
                str(kind),
                str(schema),
                str(profiles or ""),
                str(hashed or ""),
                str(encoding),
                str(serialization),
            ),
        )


def _all(database: sqlite3.Connection, query: str, values: tuple[object, ...] = ()) -> list[Any]:
    return database.execute(query, values).fetchall()
