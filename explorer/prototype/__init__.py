"""The prototype: the bodies of each leg, their sizes, shapes, masses and placements."""
