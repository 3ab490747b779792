"""Starting systems from a program: trees, command-line arguments, signals, `run`, `open_node` and `execute`."""
