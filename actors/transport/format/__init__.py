"""The format of ROS 2's `rmw_zenoh`: pure functions between values and the texts and bytes sent over a Zenoh network.

Each module covers one subject and has a writer and a parser:

* `names`: names and types of ROS, numbers and sessions as parts of a key expression,
* `keys`: the key expression of a topic or service; `buffers`: the additional keys of topics with byte arrays,
* `qos`: quality of service as text; `tokens`: the liveliness tokens of nodes and endpoints; `gids`: identifiers computed from tokens,
* `attachments`: the 33 bytes sent with every message; `extensions`: what this library appends to them; `replies`: errors of a service.

A writer raises `WireFormatError` for a value that the format cannot represent, a parser for a text or bytes that are not in the format;
neither raises anything else. Parsers also accept variants that writers do not produce. What a parser reads from the form that a writer
produces is written back unchanged.
"""
