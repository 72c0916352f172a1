"""The page: state and jobs know no browser; scene, panels and server draw them in viser."""
