"""`python -m robot run`: the whole robot in a world, watched by a judge, with a report at the end."""
