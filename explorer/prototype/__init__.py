"""The prototype: the sizes and shapes of the bodies of each leg, and whether they can be built."""
