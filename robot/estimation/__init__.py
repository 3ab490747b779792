"""From samples and scans to states: the robot's own, that of its sensors, and what stands around it. No clock, no messages."""
