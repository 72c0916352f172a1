"""Studies in a browser: clicks and brushes in the plots."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tab import Tab

from explorer.app.features.studies.feature import StudiesPanel
from explorer.app.features.studies.feed import PlotJson
from explorer.app.features.studies.state import Studies, StudyPlan
from explorer.app.session.session import UNDO
from explorer.mechanism.design_file import PRESETS
from explorer.sweep.parts import write_part
from explorer.sweep.results import Results, load_results
from explorer.sweep.rows import evaluate
from explorer.sweep.study import Objective, Sampling, Study, encode_study

OPTIMAL = PRESETS["paper-optimal"]
# Panels and drawer side by side.
WINDOW = {"width": 1280, "height": 900}
COUNT = 24

# Where a point of the scatter plot is in the window, and what each trace of it shows.
POINT = """([name, x, y]) => {
  const plot = document.querySelectorAll(".js-plotly-plot")[1], { xaxis, yaxis } = plot._fullLayout;
  plot.scrollIntoView({ block: "center" });
  const box = plot.getBoundingClientRect();
  return [box.x + xaxis._offset + xaxis.l2p(x), box.y + yaxis._offset + yaxis.l2p(y)];
}"""
LEFT_OUT = """() => [0, 2].flatMap((k) =>
  Array.from(document.querySelectorAll(".js-plotly-plot")[1]._fullData[k].customdata || []))"""
BRUSHES = """() => document.querySelector(".js-plotly-plot").layout.shapes"""
# Close to where the line of a design crosses the third axis, that of the volume.
LINE = """(design) => {
  const plot = document.querySelector(".js-plotly-plot"), { xaxis, yaxis } = plot._fullLayout;
  const box = plot.querySelector(".nsewdrag").getBoundingClientRect();
  const count = plot.layout.meta.axes.length;
  const trace = plot._fullData.find((each) => each.customdata?.includes(design));
  const at = Array.from(trace.customdata).indexOf(design) * (count + 1) + 2;
  const height = 0.95 * trace.y[at] + 0.05 * trace.y[at + 1];
  return [box.x + xaxis.l2p(2.05), box.y + yaxis.l2p(height)];
}"""
# Where an axis is in the window: from left, and its top and foot.
AXIS = """(axis) => {
  const plot = document.querySelector(".js-plotly-plot"), { xaxis, yaxis } = plot._fullLayout;
  const box = plot.querySelector(".nsewdrag").getBoundingClientRect();
  return [box.x + xaxis.l2p(axis), box.y + yaxis.l2p(1), box.y + yaxis.l2p(0)];
}"""
TOP = "() => document.querySelector('.js-plotly-plot').scrollIntoView({ block: 'center' })"


@pytest.fixture
def folder(data_tab: Tab) -> Path:
    """The folder of a study that the explorer offers."""
    study = Study(
        name="Some",
        design=OPTIMAL,
        variables={"a3x": (12.0, 20.0), "b2": (-4.0, 4.0)},
        sampling=Sampling(count=COUNT),
        measures=("volume", "reach"),
        objectives=(Objective("volume", "max"), Objective("reach", "min")),
        chunk=COUNT,
    )
    feed = panel_of(data_tab).feed
    folder = feed.folders.home / "some"
    folder.mkdir(parents=True)
    write_part(folder, study, 0, [evaluate(encode_study(study), 0, COUNT)])
    feed.look()
    return folder


def open_studies(tab: Tab) -> None:
    tab.resize((WINDOW["width"], WINDOW["height"]))
    tab.turn_to("Studies")
    tab.settle()


def panel_of(tab: Tab) -> StudiesPanel:
    return tab.running.page.services.get(StudiesPanel)


def wait_for_plots(tab: Tab) -> None:
    """Wait until the plots are those of the state, and are listened to."""
    feed = panel_of(tab).feed

    def plots() -> tuple[PlotJson, PlotJson] | None:
        drawing, studies = feed.drawing, replace(Studies.of(tab.state), plan=StudyPlan())
        is_new = drawing is not None and drawing.studies == studies and feed.wait_until_idle(0.0)
        return drawing.plots if drawing is not None and is_new else None

    shows = """(revision) => { const all = [...document.querySelectorAll(".js-plotly-plot")];
      return all.length === 2 && all.every((each) => each.explorerListens)
        && all[0].layout.selectionrevision === revision; }"""

    def are_shown() -> bool:
        # A study that has just been computed is drawn again, so which ones they are may change.
        found = plots()
        if found is None:
            return False
        return bool(tab.page.evaluate(shows, revision_in(found[0].to_json())))

    tab.wait_for(are_shown, "the plots of the state")
    # A plot that has come moves those below it.
    tab.settle()


def revision_in(text: str) -> int:
    return int(json.loads(text)["layout"]["selectionrevision"])


def studies_of(tab: Tab) -> Studies:
    return Studies.of(tab.state)


def test_design_is_picked_and_brushed_by_clicks_and_drags_in_the_plots(
    data_tab: Tab, folder: Path
) -> None:
    tab, results = data_tab, load_results(folder)
    volume, reach = results.columns["volume"], results.columns["reach"]
    open_studies(tab)
    tab.choose("Study", "some")
    wait_for_plots(tab)

    # A click on a point opens that very design.
    row = loneliest_row(results)
    click_until_picked(
        tab,
        lambda: tab.page.evaluate(POINT, ["", volume[row], reach[row]]),
        int(results.columns["index"][row]),
    )
    assert tab.state.design == results.design_of_row(row)
    wait_for_plots(tab)

    # A box around it brushes both axes, and all else is left out.
    place = tab.page.evaluate(POINT, ["", volume[row], reach[row]])
    tab.page.mouse.move(place[0] - 12, place[1] - 12)
    tab.page.mouse.down()
    tab.page.mouse.move(place[0] + 12, place[1] + 12, steps=4)
    tab.page.mouse.up()
    tab.wait_for(lambda: len(studies_of(tab).brushes) == 2, "a box")
    assert {each.axis for each in studies_of(tab).brushes} == {"volume", "reach"}
    wait_for_plots(tab)
    assert_left_out(tab, results)
    assert row not in tab.page.evaluate(LEFT_OUT)

    # What is undone is gone from the plots too.
    tab.running.page.session.do(UNDO)
    tab.wait_for(lambda: not studies_of(tab).brushes, "no brush")
    wait_for_plots(tab)
    assert tab.page.evaluate(LEFT_OUT) == []
    assert tab.page.evaluate(BRUSHES) == []

    # A click on a line opens its design: the top of an axis is met by one line alone.
    tab.page.evaluate(TOP)
    other = int(volume.argmax())
    click_until_picked(tab, lambda: tab.page.evaluate(LINE, other), other)
    assert tab.state.design == results.design_of_row(other)
    wait_for_plots(tab)

    # A drag along an axis brushes it.
    tab.page.evaluate(TOP)
    x, top, foot = tab.page.evaluate(AXIS, 1)
    tab.page.mouse.move(x, 0.7 * top + 0.3 * foot)
    tab.page.mouse.down()
    tab.page.mouse.move(x, 0.3 * top + 0.7 * foot, steps=4)
    tab.page.mouse.up()
    tab.wait_for(lambda: len(studies_of(tab).brushes) == 1, "a brush")
    (brush,) = studies_of(tab).brushes
    assert brush.axis == "b2"
    ((low, high),) = brush.ranges
    assert -4.2 < low < high < 4.2
    wait_for_plots(tab)
    assert_left_out(tab, results)
    assert 0 < len(tab.page.evaluate(LEFT_OUT)) < COUNT

    tab.page.get_by_title("Free all axes.").click()
    tab.wait_for(lambda: not studies_of(tab).brushes, "no brush")
    wait_for_plots(tab)
    drawing = panel_of(tab).feed.drawing
    assert drawing is not None
    best = int(results.columns["index"][drawing.front[0]])
    tab.page.get_by_title(f"Open design {best}", exact=True).click()
    tab.wait_for(lambda: studies_of(tab).picked == best, "the best")
    assert tab.state.design == results.design_of_row(int(drawing.front[0]))


def click_until_picked(tab: Tab, place: Callable[[], tuple[float, float]], index: int) -> None:
    """Click on a design in a plot until it is picked.

    Plotly forgets where the pointer is when it draws a plot, and takes no click there until the
    pointer has moved, which a user does without a thought.
    """

    def is_picked() -> bool:
        if studies_of(tab).picked == index:
            return True
        x, y = place()
        tab.page.mouse.move(x - 3, y)
        tab.page.mouse.move(x, y, steps=3)
        # Longer than the throttle of Plotly's hover.
        tab.page.wait_for_timeout(100)
        tab.page.mouse.click(x, y)
        tab.settle()
        if studies_of(tab).picked == index:
            return True
        # Two clicks would be a double one within 0.3 s.
        tab.page.wait_for_timeout(400)
        return False

    tab.wait_for(is_picked, f"a pick of design {index}")


def loneliest_row(results: Results) -> int:
    """Return the row whose point is farthest from all others in the scatter plot."""
    points = np.column_stack([results.columns["volume"], results.columns["reach"]])
    points = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return int(apart.min(axis=1).argmax())


def assert_left_out(tab: Tab, results: Results) -> None:
    """Compare what the plot leaves out with the law, row by row."""
    expected = [
        int(index)
        for row, index in enumerate(results.columns["index"].tolist())
        if not all(
            any(low <= results.columns[brush.axis][row] <= high for low, high in brush.ranges)
            for brush in studies_of(tab).brushes
        )
    ]
    assert sorted(tab.page.evaluate(LEFT_OUT)) == expected
