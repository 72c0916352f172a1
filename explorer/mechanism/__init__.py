"""The manipulator: its design, its poses and its kinematics in closed form."""
