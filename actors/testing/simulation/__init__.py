"""Simulation testing: one program, thousands of seeds, each another legal order of events and another set of faults."""
