"""The parts of panels: markup, buttons, charts and the theme."""
