"""What panels are made of: markup, buttons, charts, the palette and the theme."""
