"""All that a page shows, as plain values, so that two pages can be compared."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from html import unescape
from typing import Any

import numpy as np
import viser

from explorer.app.server import Running

# Orders are counted over all of a process; browsers turn these without being asked.
PASSING = {"order", "_order", "_tab_container_ids"}

# The track of a slider holds still while it is moved, so that it depends on what was done.
OF_TRACKS = {"min", "max", "_marks"}
ROUNDING = 1e-9
# Properties that hold text or markup, and the texts of markup.
TEXTS = (" content", " label", " hint", " text", " value")
TAG = re.compile("<[^>]*>")
ATTRIBUTE = re.compile(' (?:title|aria-label)="([^"]*)"')
# What is told of the way here: how long it took, and which browser led it.
OF_THE_WAY = re.compile(r'(?<=Computed in<).*?ms|<span class="ex-author".*?</span>')


def shown_by(running: Running) -> dict[str, object]:
    """Return every property of every control and scene node, by where it is.

    Ids, which differ from page to page, are replaced by their number in it.
    """
    gui: Any = running.viser.gui
    found: dict[str, object] = {}
    ids: dict[str, str] = {}
    for place, handle in _handles(gui._container_handle_from_uuid["root"], "gui"):
        ids[handle._impl.uuid] = place
        found.update(_properties(place, handle))
    for panel, handle in enumerate(gui._panel_handle_from_uuid.values()):
        for tab, container in enumerate(handle._tab_handles):
            for place, inner in _handles(container, f"panel {panel} tab {tab}"):
                ids[inner._impl.uuid] = place
                found.update(_properties(place, inner))
    scene: Any = running.viser.scene
    for name, handle in scene._handle_from_node_name.items():
        found[f"{name} visible"] = handle.visible
        found[f"{name} position"] = tuple(np.asarray(handle.position).tolist())
        found[f"{name} wxyz"] = tuple(np.asarray(handle.wxyz).tolist())
        found.update(_properties(name, handle))
    return {key: _named(value, ids) for key, value in found.items()}


def shown_texts(running: Running) -> Iterator[tuple[str, str]]:
    """Yield the texts of all controls and scene nodes, with where they are; markup has several."""
    for place, value in shown_by(running).items():
        if isinstance(value, str) and place.endswith(TEXTS):
            for text in (*TAG.split(value), *ATTRIBUTE.findall(value)):
                if text.strip():
                    yield place, unescape(text)


def differences(one: Mapping[str, object], other: Mapping[str, object]) -> list[str]:
    """Return what differs, in words; numbers that agree to twelve digits are the same.

    What neither shows is left out.
    """
    said = [
        f"{key}: {_apart(one.get(key), other.get(key))}"
        for key in {**one, **other}
        if not _same(one.get(key), other.get(key)) and not _is_hidden(key, one, other)
    ]
    return sorted(said)


def _is_hidden(key: str, one: Mapping[str, object], other: Mapping[str, object]) -> bool:
    visible = f"{key.rpartition(' ')[0]} visible"
    return key != visible and one.get(visible) is False and other.get(visible) is False


def _handles(container: Any, place: str) -> Iterator[tuple[str, Any]]:
    for number, handle in enumerate(container._children.values()):
        inner = f"{place} / {number} {type(handle).__name__}"
        yield inner, handle
        if getattr(handle._impl.props, "visible", True) is False:
            # What is within is not seen either.
            continue
        if hasattr(handle, "_children"):
            yield from _handles(handle, inner)
        for tab, each in enumerate(getattr(handle, "_tab_handles", ())):
            yield from _handles(each, f"{inner} tab {tab}")


def _properties(place: str, handle: Any) -> dict[str, object]:
    state = handle._impl
    found: dict[str, object] = {}
    props = state.props
    is_slider = isinstance(handle, viser.GuiSliderHandle | viser.GuiMultiSliderHandle)
    if dataclasses.is_dataclass(props):
        for each in dataclasses.fields(props):
            if each.name not in PASSING and not (is_slider and each.name in OF_TRACKS):
                found[f"{place} {each.name}"] = getattr(props, each.name)
    value = getattr(state, "value", None)
    if is_slider:
        low, high = handle.min - ROUNDING, handle.max + ROUNDING
        is_within = (low <= np.array(value)) & (np.array(value) <= high)
        assert is_within.all(), f"{place}: {value} lies beyond its track"
    if value is not None and not getattr(state, "is_button", False):
        found[f"{place} value"] = value
    return found


def _named(value: object, ids: Mapping[str, str]) -> object:
    if isinstance(value, str):
        for uuid, place in ids.items():
            if uuid in value:
                value = value.replace(uuid, place)
        return OF_THE_WAY.sub("", value)
    return value


def _same(one: Any, other: Any) -> bool:
    kinds: set[type] = {type(one), type(other)}
    if kinds == {np.ndarray}:
        if one.shape != other.shape:
            return False
        if one.dtype.kind == "f":
            return np.allclose(one, other, rtol=1e-12, atol=1e-12, equal_nan=True)
        return bool(np.array_equal(one, other))
    if kinds == {float}:
        return one == other or abs(one - other) <= 1e-12 * max(1.0, abs(one))
    if kinds <= {tuple, list}:
        return len(one) == len(other) and all(map(_same, one, other))
    return bool(one == other)


def _apart(one: object, other: object) -> str:
    """Return where two values part, with a little before it."""
    texts = repr(one), repr(other)
    pairs = enumerate(zip(*texts, strict=False))
    agree = next((index for index, (a, b) in pairs if a != b), min(map(len, texts)))
    first, second = (text[max(0, agree - 60) : agree + 60] for text in texts)
    return f"… {first} … beside … {second} …"
