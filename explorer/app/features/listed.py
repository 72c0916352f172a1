"""The features of the page, in the order of their tabs and of their parts of the bar."""

from __future__ import annotations

from explorer.app.features.compare.feature import COMPARE
from explorer.app.features.designs.feature import DESIGNS
from explorer.app.features.feature import Feature
from explorer.app.features.forces.feature import FORCES
from explorer.app.features.help.feature import HELP
from explorer.app.features.history.feature import HISTORY
from explorer.app.features.legs.feature import LEGS
from explorer.app.features.machine.feature import MACHINE
from explorer.app.features.mechanism.feature import MECHANISM
from explorer.app.features.optimise.feature import OPTIMISE
from explorer.app.features.orientation.feature import ORIENTATION
from explorer.app.features.paths.feature import PATHS
from explorer.app.features.precision.feature import PRECISION
from explorer.app.features.prototype.feature import PROTOTYPE
from explorer.app.features.sharing.feature import SHARING
from explorer.app.features.singularity.feature import SINGULARITY
from explorer.app.features.studies.feature import STUDIES
from explorer.app.features.view.feature import VIEW
from explorer.app.features.workspace.feature import WORKSPACE

FEATURES: tuple[Feature, ...] = (
    DESIGNS,
    MECHANISM,
    MACHINE,
    HISTORY,
    VIEW,
    SINGULARITY,
    WORKSPACE,
    ORIENTATION,
    LEGS,
    FORCES,
    PRECISION,
    PROTOTYPE,
    OPTIMISE,
    STUDIES,
    COMPARE,
    PATHS,
    SHARING,
    HELP,
)
