"""Topics used wrongly: each marked line is one error, for the checkers that it names."""

from __future__ import annotations

from actors import Node, Topic, background, every, publishes, subscribes
from actors.interfaces.std_msgs.msg import Int32, String

WORDS = Topic(String, "words")
NUMBERS = Topic(Int32, "numbers")


class Wrong(Node):
    words = publishes(WORDS)
    numbers = subscribes(NUMBERS)

    def publish(self) -> None:
        self.words(Int32(data=1))  # E
        self.words.publish("hello")  # E
        self.words(String(text="hello"))  # E
        self.words(String(data=1))  # E
        self.publisher(NUMBERS).publish(String(data="one"))  # E

    async def send(self) -> None:
        await self.words.send(Int32(data=1))  # E

    def call_the_contract(self) -> None:
        Wrong.words(String(data="hello"))  # E

    @WORDS.on()  # E
    def takes_another_type(self, message: Int32) -> None: ...

    @WORDS.on()  # E
    async def takes_nothing(self) -> None: ...

    @WORDS.on()  # E
    def returns_something(self, message: String) -> int:
        return len(message.data)

    @WORDS.on(concurrent="two")  # E
    async def not_a_number(self, message: String) -> None: ...

    @every(hz=10)  # E
    async def returns_from_a_tick(self) -> int:
        return 1

    @every(hz=10, late="never")  # E
    async def unheard_of_policy(self) -> None: ...

    @background  # E
    def not_a_coroutine(self) -> None: ...


def assign(node: Wrong) -> None:
    node.words = node.publisher(WORDS)  # E


def assign_stream(node: Wrong) -> None:
    node.numbers = node.subscribe(NUMBERS)  # E


async def listen(node: Node) -> int:
    async for message in node.subscribe(WORDS):
        return message.data  # E
    number: String = await node.subscribe(NUMBERS).next()  # E
    newest: Int32 = node.subscribe(NUMBERS).latest  # E
    return len(number.data) + newest.data


def take_number(message: Int32) -> None: ...


def take_later(node: Node) -> None:
    node.on(WORDS, take_number)  # E


def declare() -> None:
    Topic("geometry_msgs/msg/Twist", "cmd_vel")  # E
    Topic(String, "words", qos="reliable")  # E
    Topic(int, "numbers")  # E
