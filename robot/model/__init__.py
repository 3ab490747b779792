"""What the robot is: its parameters, its kinematics, and how its mass lies. Figures and functions of figures, no state."""
