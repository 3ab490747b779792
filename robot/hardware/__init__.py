"""What controllers meet of a robot: the interface of a body and its parts, and where its sensors sit. A back end implements it."""
