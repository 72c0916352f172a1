"""The parts of a page in viser, whatever mechanism it shows."""
