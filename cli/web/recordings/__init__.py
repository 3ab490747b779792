"""The bags of one folder, and a recording that is played for its clients."""
