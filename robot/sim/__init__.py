"""Bodies that are not real, behind the interface of `robot.hardware`, with the noise of their sensors."""
