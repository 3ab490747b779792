"""What a process bears that others do not wish well: `python -m tests.hostile wire --messages 1000000`."""
