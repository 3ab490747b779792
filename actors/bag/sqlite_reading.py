"""Reading the sqlite3 files of rosbag2, of any version."""

from __future__ import annotations

import sqlite3
from collections.abc import Container, Iterator
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actors.bag.contents import BagError, BagMessage, BagTopic
from actors.bag.metadata import BagFile, BagMetadata

if TYPE_CHECKING:
    from actors.bag.newest import Newest

__all__ = ["SqliteReading"]


class SqliteReading:
    """One sqlite3 file of a bag. It is opened anew for each pass over its messages. Bags of older versions hold no definitions."""

    cut = False

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with closing(self._open()) as database:
                self._topics = dict(_topics(database))
                self._counts = dict(_all(database, "SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id"))
                self._times = _all(database, "SELECT MIN(timestamp), MAX(timestamp) FROM messages")[0]
        except sqlite3.Error as error:
            raise BagError(f"{path} is no sqlite3 file of a bag: {error}") from error

    def metadata(self) -> BagMetadata:
        """What the file holds."""
        topics = {topic: self._counts.get(number, 0) for number, topic in self._topics.items()}
        start, end = (time or 0 for time in self._times)
        file = BagFile(self.path.name, start, end - start, sum(topics.values()))
        return BagMetadata(storage="sqlite3", topics=topics, files=(file,), ros_distro="")

    def messages(self, start_ns: int, topics: Container[str] | None) -> Iterator[BagMessage]:
        """The messages received from `start_ns` on, in order of receipt, of these topics or all."""
        with closing(self._open()) as database:
            query = "SELECT topic_id, timestamp, data FROM messages WHERE timestamp >= ? ORDER BY timestamp, id"
            for number, time, data in database.execute(query, (start_ns,)):
                topic = self._topics[number]
                if topics is None or topic.name in topics:
                    yield BagMessage(topic, data, time, time)

    def before(self, end_ns: int, newest: Newest, file: int) -> None:
        """Add the messages received before `end_ns` that may be the newest of their topics."""
        query = (
            "SELECT id, timestamp, data FROM messages WHERE topic_id = ? AND timestamp < ? "
            "ORDER BY timestamp DESC, id DESC LIMIT ?"
        )
        with closing(self._open()) as database:
            for number, topic in self._topics.items():
                wanted = newest.counts.get(topic.name, 0)
                for id, time, data in database.execute(query, (number, end_ns, wanted)):
                    newest.add(BagMessage(topic, data, time, time), (file, id, 0))

    def _open(self) -> sqlite3.Connection:
        if not self.path.is_file():
            raise BagError(f"{self.path}: there is no such file")
        return sqlite3.connect(f"{self.path.resolve().as_uri()}?mode=ro", uri=True, check_same_thread=False)


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
        schema, encoding = definitions.get(kind, ("", "ros2msg"))
        yield number, BagTopic(name, kind, schema, profiles, hashed, encoding, serialization)


def _all(database: sqlite3.Connection, query: str) -> list[Any]:
    return database.execute(query).fetchall()
