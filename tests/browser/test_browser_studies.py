"""Studies in a browser: clicks and brushes in the plots."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.studies.feature import StudiesPanel
from explorer.app.features.studies.figures import LEFT_OUT, PlotName, PlotRows, reading_of
from explorer.app.features.studies.state import Studies, StudyPlan, open_study, within
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

# A plot by its name, brought into view, as its box: left, top, width and height.
BOX = """(plot) => {
  const svg = document.querySelector(`.is-${plot} [data-plot]`);
  svg.scrollIntoView({ block: "center" });
  const { x, y, width, height } = svg.getBoundingClientRect();
  return [x, y, width, height];
}"""


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


def wait_for_plots(tab: Tab) -> PlotRows:
    """Wait until the plots are those of the state; return their rows and axes."""
    tab.settle()
    feed, studies = panel_of(tab).feed, replace(Studies.of(tab.state), plan=StudyPlan())
    tab.wait_for(
        lambda: feed.drawing is not None and feed.drawing.studies == studies,
        "the plots of the state",
    )
    tab.settle()
    assert feed.drawing is not None
    assert feed.drawing.plotted is not None
    return feed.drawing.plotted


def point_in(tab: Tab, plot: PlotName, place: tuple[float, float]) -> tuple[float, float]:
    """Return where a place on a plot is in the window, scrolled into view."""
    left, top, width, height = tab.page.evaluate(BOX, plot)
    return left + place[0] * width, top + (1.0 - place[1]) * height


def drag(tab: Tab, start: tuple[float, float], end: tuple[float, float]) -> None:
    tab.page.mouse.move(*start)
    tab.page.mouse.down()
    tab.page.mouse.move(*end, steps=4)
    tab.page.mouse.up()
    tab.settle()


def studies_of(tab: Tab) -> Studies:
    return Studies.of(tab.state)


def test_design_is_picked_and_brushed_by_clicks_and_drags_in_the_plots(
    data_tab: Tab, folder: Path
) -> None:
    tab, results = data_tab, load_results(folder)
    open_studies(tab)
    tab.choose("Study", "some")
    plotted = wait_for_plots(tab)
    table = tab.export("Study", "CSV").path().read_text().splitlines()
    assert [line.split(",")[0] for line in table[1:]] == [*map(str, range(COUNT))]

    # What the pointer is on is read, and a click opens that very design.
    row = loneliest_row(results)
    x, y = plotted.places("points", np.array([row]))[0, 0].tolist()
    place = point_in(tab, "points", (x, y))
    tab.page.mouse.move(*place)
    words, path = reading_of(plotted, "points", row)
    expect(tab.page.get_by_text(words, exact=True)).to_be_visible()
    expect(tab.page.locator(f'.is-points .near[d="{path}"]')).to_have_count(1)
    tab.page.mouse.click(*place)
    tab.settle()
    assert studies_of(tab).picked == results.columns["index"][row]
    assert tab.state.design == results.design_of_row(row)
    wait_for_plots(tab)

    # A box around it brushes both axes, and all else is left out.
    left, top = point_in(tab, "points", (x, y))
    drag(tab, (left - 12, top - 12), (left + 12, top + 12))
    assert [each.axis for each in studies_of(tab).brushes] == ["volume", "reach"]
    seen = wait_for_plots(tab)
    assert seen.inside[row]
    assert_left_out(tab, results)

    # What is undone is gone from the plots too.
    tab.running.page.session.do(UNDO)
    wait_for_plots(tab)
    assert not studies_of(tab).brushes
    expect(tab.page.locator(".brush")).to_have_count(0)

    # A click on a line opens its design: the top of an axis is met by one line alone.
    other = int(results.columns["volume"].argmax())
    top_of_axis, after = plotted.places("lines", np.array([other]))[0, 2:4]
    tab.page.mouse.click(*point_in(tab, "lines", tuple(0.95 * top_of_axis + 0.05 * after)))
    tab.settle()
    assert studies_of(tab).picked == other
    assert tab.state.design == results.design_of_row(other)
    wait_for_plots(tab)

    # A drag along an axis brushes it, and a double click frees the axes.
    middle = float(plotted.middles()[1])
    drag(tab, *(point_in(tab, "lines", (middle, share)) for share in (0.7, 0.3)))
    (brush,) = studies_of(tab).brushes
    assert brush.axis == "b2"
    ((low, high),) = brush.ranges
    assert -4.2 < low < high < 4.2
    seen = wait_for_plots(tab)
    assert_left_out(tab, results)
    assert 0 < seen.inside.sum() < COUNT
    # Though on the line of another design, it picks none.
    least = plotted.places("lines", np.array([int(results.columns["volume"].argmin())]))
    place = point_in(tab, "lines", tuple(0.95 * least[0, 2] + 0.05 * least[0, 3]))
    # Two clicks of a slow browser are a double one, too.
    with tab.slow_time():
        tab.page.mouse.dblclick(*place)
    tab.settle()
    assert not studies_of(tab).brushes
    assert studies_of(tab).picked == other

    wait_for_plots(tab)
    drawing = panel_of(tab).feed.drawing
    assert drawing is not None
    best = int(results.columns["index"][drawing.front[0]])
    tab.page.get_by_title(f"Open design {best}", exact=True).click()
    tab.wait_for(lambda: studies_of(tab).picked == best, "the best")
    assert tab.state.design == results.design_of_row(int(drawing.front[0]))


def test_plots_that_are_gone_are_read_no_more(data_tab: Tab, folder: Path) -> None:
    tab, session = data_tab, data_tab.running.page.session
    open_studies(tab)
    reading = tab.page.locator(".is-points + .ex-reading")
    for _ in range(2):
        session.do(open_study(folder.name))
        plotted = wait_for_plots(tab)
        row = loneliest_row(load_results(folder))
        x, y = plotted.places("points", np.array([row]))[0, 0].tolist()
        tab.page.mouse.move(*point_in(tab, "points", (x, y)))
        expect(reading).to_have_text(reading_of(plotted, "points", row)[0])
        # The study is closed in another tab, while the pointer rests on its plot.
        session.do(open_study(None))
        expect(tab.page.locator("[data-plot]")).to_have_count(0)
        tab.page.mouse.move(WINDOW["width"] // 2, 4)


def loneliest_row(results: Results) -> int:
    """Return the row whose point is farthest from all others in the scatter plot."""
    points = np.column_stack([results.columns["volume"], results.columns["reach"]])
    points = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return int(apart.min(axis=1).argmax())


def assert_left_out(tab: Tab, results: Results) -> None:
    """Compare the designs that the points leave out with the law, row by row."""
    inside = within(results.columns, studies_of(tab).brushes)
    left_out = tab.page.locator(f'.is-points [style="stroke:{LEFT_OUT}"]')
    assert str(left_out.get_attribute("d")).count("M") == (~inside).sum() > 0
