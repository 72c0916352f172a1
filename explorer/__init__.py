"""Design explorer of the flagged 4-4 parallel manipulator.

The stub beside this file lists the public names; each is loaded on first use, so that
`import explorer` is fast.
"""

import lazy_loader  # pyright: ignore[reportMissingTypeStubs]

__version__ = "0.1.0"

# The stub has the types.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(  # pyright: ignore[reportUnknownVariableType]
    __name__, __file__
)
