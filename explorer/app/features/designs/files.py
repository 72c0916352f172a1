"""The live design as a file, sent to one browser."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.session.session import Who
from explorer.mechanism.design_file import encode_design


class DesignFile:
    """Sends the live design as a design file."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._downloads = services.downloads

    def send(self, who: Who) -> None:
        """Send the design as JSON."""
        design = self._session.settled().design
        self._downloads.send(who, f"{design.name}.json", encode_design(design))
