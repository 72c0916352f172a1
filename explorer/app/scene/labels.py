"""Labels at points of the scene.

A script of the page, `labels.js`, draws them over the scene: without boxes, apart from each other,
and pale where a body hides their point.
"""

from __future__ import annotations

import viser

from explorer.app.widgets.colours import Rgb


def add_label(
    scene: viser.SceneApi,
    name: str,
    text: str,
    *,
    colour: Rgb | None = None,
    fades: bool = True,
    visible: bool = True,
) -> viser.LabelHandle:
    """Add a label; its `text`, `position` and `visible` are assigned like those of other nodes.

    Args:
        scene: Scene of the label.
        name: Name of the node; its parent is the frame of the label's position.
        text: Text of the label.
        colour: Colour of the text; None for that of the page's text.
        fades: Whether the label is pale where a body hides its point.
        visible: Whether the label is drawn.
    """
    # viser's labels have no colour; they use the scene height only if their size is that of
    # things in the scene, so that the script finds the colour there.
    red, green, blue = (0, 0, 0) if colour is None else colour
    return scene.add_label(
        name,
        text,
        font_scene_height=float(red << 16 | green << 8 | blue),
        depth_test=fades,
        visible=visible,
    )
