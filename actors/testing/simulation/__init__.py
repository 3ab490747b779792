"""Simulation testing: one program under thousands of seeds, each with another legal order of events and other faults."""
