"""Blocks: the page and the report tell the same words for one value."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

import pytest
from machines import FULL

from explorer import Pose, evaluate
from explorer.app.widgets.blocks import render
from explorer.export.drawings.markup import elements
from explorer.measures.blocks.block import Block, Facts
from explorer.measures.blocks.forces import largest_loads, reaction_tables, verdict
from explorer.measures.blocks.precision import deflections, tool_errors
from explorer.measures.blocks.singularity import (
    conditioning,
    free_ball,
    freedoms,
    gains,
    margin_table,
)
from explorer.mechanism.design_file import typical_machine
from explorer.singularity.ellipsoids import performance, singularity_free_ball
from explorer.statics.loaded import LoadedPose, ToolPrecision

MACHINE = typical_machine(FULL)[0]
SINGULAR = Pose((10.0, 5.0, 0.0), MACHINE.home_pose.quaternion)


def forces_of(pose: Pose) -> Iterable[Block]:
    loaded = LoadedPose(MACHINE, pose, (1.0, 2.0, -10.0, 0.0, 3.0, 0.0))
    return verdict(loaded), *reaction_tables(loaded), largest_loads(loaded)


def precision_of(pose: Pose) -> Iterable[Block]:
    precision = ToolPrecision(LoadedPose(MACHINE, pose, (1.0, 2.0, -10.0, 0.0, 3.0, 0.0)))
    return *tool_errors(precision), *deflections(precision, "the load")


def singularity_of(pose: Pose) -> Iterable[Block]:
    snapshot = evaluate(MACHINE, pose)
    ball = free_ball(snapshot, singularity_free_ball(pose), "b4")
    answer = margin_table(snapshot), conditioning(snapshot), Facts("", (ball,))
    return *freedoms(snapshot), *answer, gains(performance(MACHINE, pose), "b4")


def words_of(text: str) -> set[str]:
    """Return the words and numbers of a text; the report has a decimal more of each share."""
    return set(re.findall(r"[^\s,;:()±]+", re.sub(r"[\d.]+\s%", "", text)))


@pytest.mark.parametrize("answer", [forces_of, precision_of, singularity_of])
@pytest.mark.parametrize("pose", [MACHINE.home_pose, SINGULAR])
def test_page_and_report_tell_the_same_words_for_one_value(
    answer: Callable[[Pose], Iterable[Block]], pose: Pose
) -> None:
    blocks = list(answer(pose))
    page = re.sub("<[^>]*>", " ", re.sub("°", " ° ", render(blocks).replace("&#x27;", "'")))
    report = " ".join(text for each in elements(blocks) for text in each.itertext())
    assert words_of(page.replace("&nbsp;", " ")) <= words_of(report.replace("°", " ° "))
