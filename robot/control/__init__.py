"""From states and goals to commands: legs, arm, and the twist multiplexer. No clock, no messages."""
