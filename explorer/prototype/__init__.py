"""The mechanism as things: the bodies of each leg, their sizes, their shapes and where they are."""
