"""What people write: `Node`, its declarations, and what they are checked for."""
