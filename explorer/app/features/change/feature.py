"""The last change of the design: a ghost of what was before, and the differences."""

from __future__ import annotations

from explorer.app.features.change.before import DesignChange
from explorer.app.features.change.card import ChangeCard
from explorer.app.features.change.scene import ChangeScene
from explorer.app.features.feature import Feature, InBar

CHANGE = Feature(
    "change",
    bar=(InBar("left", ChangeCard),),
    scene=(ChangeScene,),
    feeds=(DesignChange,),
)
