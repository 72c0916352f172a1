"""Where the manipulator is singular, how near that is, and what it can move there."""
