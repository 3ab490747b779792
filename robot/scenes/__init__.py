"""What stands in a world: values that the simulators, the map and the pictures share."""
