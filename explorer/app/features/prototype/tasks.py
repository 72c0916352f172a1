"""The worker's tasks for files of the mechanism."""

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
        from explorer.export.step import assembly_step
        from explorer.prototype.fitting import sizes_of

        return assembly_step(sizes_of(design))
    return assembly_bytes(make_prototype(design), file_format)


def export_simulation(design: Design, density: float) -> bytes:
    """Return the model for physics engines as MJCF.

    Args:
        design: The manipulator.
        density: Density of its bodies, in kg/m³.

    Raises:
        ExplorerError: a design without a model, such as one with legs of length zero.
    """
    from explorer.export.simulation import simulation_mjcf

    return simulation_mjcf(design, density).encode()
