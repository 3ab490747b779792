"""The wire: what connects the graph of this process with those of other processes and machines."""
