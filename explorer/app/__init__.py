"""The page: state and session know no browser; scene, panels and server draw them in viser."""
