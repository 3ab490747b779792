"""Connections of browsers and viewers: their frames, what they cost, and how messages are written for them."""
