"""From states and goals to commands: legs, paths, arm. No clock, no messages."""
