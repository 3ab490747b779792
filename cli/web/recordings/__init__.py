"""The bags of one folder, and a recording that is played for those who look at it."""
