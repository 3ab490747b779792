"""A transport for several systems on one event loop, virtual or real: machines that are joined by a simulated network (`network`)."""
