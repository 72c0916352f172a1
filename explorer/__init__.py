"""Design explorer of the flagged 4-4 parallel manipulator.

The public names stand in the stub beside this file; each is loaded when it is first used, so
that `import explorer` costs next to nothing.
"""

import lazy_loader  # pyright: ignore[reportMissingTypeStubs]

__version__ = "0.1.0"

# The stub has the types.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(  # pyright: ignore[reportUnknownVariableType]
    __name__, __file__
)
