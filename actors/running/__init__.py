"""From a program to a system: trees, command-line arguments, signals, `run`, `open_node`, `execute`."""
