"""The transport: the connection of this process's graph with those of other processes and machines."""
