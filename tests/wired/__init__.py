"""The scenario tests of topics, services, actions and restarts, with the test's own node in another process than the tree.

The bodies are those of tests/actors; only their `rig` is another one: its tree runs in one system, and what the test publishes, records, calls
and starts is done by a node of a second one. Both are joined by a transport.
"""
