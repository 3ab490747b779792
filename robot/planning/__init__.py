"""From where the robot is to where it shall be: on the map, and with the arm. Pure: no clock, no sensors."""
