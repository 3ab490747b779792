"""From states and goals to commands: legs, arm, and who drives. No clock, no messages."""
