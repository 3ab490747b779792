"""The robot's nodes: they carry messages to and from the rooms below, and hold no algorithm of their own."""
