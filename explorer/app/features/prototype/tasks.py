"""The worker's task for the prototype."""

from __future__ import annotations

from explorer.mechanism.design import Design


def export_assembly(design: Design, file_format: str) -> bytes:
    """Return a file of the prototype, assembled in the home pose.

    Args:
        design: The manipulator.
        file_format: A format of `explorer.export.assembly`, or "step".

    Raises:
        ExplorerError: a design too tight for the parts, or a missing library.
    """
    from explorer.export.assembly import assembly_bytes
    from explorer.prototype.assembly import make_prototype

    if file_format == "step":
        from explorer.export.step_assembly import assembly_step
        from explorer.prototype.fitting import sizes_of

        return assembly_step(sizes_of(design))
    return assembly_bytes(make_prototype(design), file_format)
