"""Design studies: many designs in plots, and small studies started from the page."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.studies.folders import study_folders
from explorer.app.features.studies.panel import StudiesPanel
from explorer.app.features.studies.words import BUTTONS
from explorer.app.features.studies.work import study_runner
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import press_button, running
from explorer.numerics.number_text import format_number


class StudyChip:
    """How far the study is, and the button that ends it."""

    def __init__(self, services: Services) -> None:
        self._runner = services.get(study_runner)

    def __call__(self, _: Frame) -> str:
        """Return the chip, as HTML; "" while no study is computed."""
        run = self._runner.run
        if run is None:
            return ""
        cancel = press_button(
            "studies.cancel",
            "",
            "Cancel",
            hint=BUTTONS["cancel"][1],
            class_name="ex-button",
            is_disabled=run.is_cancelled,
        )
        done = 0 if run.progress is None else run.progress.done
        return running("Studies", run.name, f"{format_number(done)} designs", run.share, cancel)


STUDIES = Feature(
    "studies",
    tabs=(Tab("work", "Studies", StudiesPanel, viser.Icon.CHART_DOTS),),
    bar=(InBar("right", StudyChip),),
    is_offered=lambda services: services.has(study_folders),
)
