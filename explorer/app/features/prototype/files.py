"""Files of the mechanism: its parts, and a model for physics engines."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.prototype.tasks import export_assembly, export_simulation
from explorer.app.session.session import Who

# Format of each file by its name on the page, and end of the name of the file.
ASSEMBLIES = {
    "3MF": ("3mf", "mechanism.3mf"),
    "GLB": ("glb", "mechanism.glb"),
    "STL (zip)": ("stl-zip", "parts-stl.zip"),
    "STEP": ("step", "mechanism.step"),
}


class MechanismFiles:
    """Sends the mechanism of the live design in its home pose."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._downloads = services.downloads

    def assembly(self, name: str, who: Who) -> None:
        """Send the parts in a format, one of `ASSEMBLIES`."""
        design = self._session.settled().design
        file_format, end = ASSEMBLIES[name]
        self._downloads.compute(who, f"{design.name}-{end}", export_assembly, (design, file_format))

    def simulation(self, who: Who) -> None:
        """Send the model, with the density of the prototype."""
        state = self._session.settled()
        arguments = (state.design, state.view.prototype.density)
        self._downloads.compute(
            who, f"{state.design.name}-simulation.xml", export_simulation, arguments
        )
