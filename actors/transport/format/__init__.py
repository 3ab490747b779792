"""The format of ROS 2's `rmw_zenoh`: pure functions between values and the texts and bytes that cross a Zenoh network.

Each module is one subject and pairs a writer with its parser:

* `types`, `names`: how types and names of ROS stand in a key expression,
* `keys`: the key expression of a topic or service; `buffers`: the further keys of topics with byte arrays,
* `qos`: quality of service as text; `tokens`: the liveliness tokens of nodes and endpoints; `gids`: the identifier made of a token,
* `attachments`: the 33 bytes beside every message; `extensions`: what our own peers add behind them; `replies`: errors of a service,
* `history`: the keys by which Zenoh's advanced publishers keep messages for late subscribers.

A writer raises `WireFormatError` for a value that the format cannot carry, a parser for a text or bytes that are not of the format,
and neither raises anything else. Parsers accept what other peers may write with less care than the writers take: what a parser reads is
written back the same if it was in the form that a writer gives it.
"""
