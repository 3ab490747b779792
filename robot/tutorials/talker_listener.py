"""A talker and a listener: every robot's first topic."""

from __future__ import annotations

from actors import Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import String
from robot.tutorials.program import main, system

CHATTER = Topic(String, "/chatter", 10)


class Talker(Node):
    """Publishes "Hello World n" on /chatter once a second, n from 0."""

    chatter = publishes(CHATTER)

    async def on_start(self) -> None:
        self.count = 0

    @every(period=1.0)
    def talk(self) -> None:
        text = f"Hello World {self.count}"
        self.count += 1
        self.chatter(String(data=text))
        self.log.info(f"Publishing: {text}")


class Listener(Node):
    """Says what it hears on /chatter."""

    @CHATTER.on()
    def listen(self, message: String) -> None:
        self.log.info(f"Received: {message.data}")


def tree() -> Supervisor:
    """One node that talks once a second, and one that listens."""
    return system("talker_listener", Listener, Talker)


if __name__ == "__main__":
    main(tree)
