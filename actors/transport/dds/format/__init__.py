"""How ROS 2 uses DDS: pure functions between values of ROS and the names, bytes and policies of DDS.

* `names`: topics and services of ROS as topics of DDS, with their types,
* `qos`: a profile as the policies of a DDS reader or writer,
* `user_data`: what ROS adds to the discovery data of participants and endpoints,
* `participants`: the topic ``ros_discovery_info``, which tells the nodes of each participant,
* `requests`: what is put before the body of a request or reply.

A writer raises `WireFormatError` for a value that the format cannot represent, a parser for a text or bytes that are not in the format;
neither raises anything else.
"""
