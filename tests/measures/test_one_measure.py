"""A measure has one value wherever it is listed, and is listed by one entry of the catalogue."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest
from command_line import CommandLine
from report_page import read

from explorer.app.features.compare.table import ComparedDesign, table
from explorer.app.features.compare.work import ComparedRequest, draw_compared
from explorer.app.features.sharing.reporting import make_report
from explorer.app.features.studies.state import StudyPlan, label_of, study_around, title_of
from explorer.app.features.studies.words import chips
from explorer.app.state.geometry import without_name
from explorer.cli.commands.optimise import measure_rows as measure_rows_of_command
from explorer.export.report.data import ReportData
from explorer.measures.catalogue import CATALOGUE, Measure, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, encode_design
from explorer.numerics.number_text import UNITS
from explorer.optimise.defaults import paper_problem, paper_start
from explorer.optimise.outcome import compare_designs
from explorer.sweep.rows import evaluate
from explorer.sweep.study import Study, decode_study, encode_study

pytestmark = pytest.mark.usefixtures("warm_kernels")

Places = dict[str, dict[str, float | None]]

SWIFT = [name for name, each in measures_in("studies").items() if each.cost == "low"]


def found() -> Design:
    """Return an optimum of the paper's problem, of twice its start's reach and off its grid."""
    values = [19.056, 9.5175, 2.027, -4.7727, 5.5619, 4.7706]
    design = paper_start().with_variables(values)
    return msgspec.structs.replace(design, name="found")


def values_of_places(design: Design, folder: Path, capsys: pytest.CaptureFixture[str]) -> Places:
    """Return the values that each place shows of a design, by place and label."""
    paper = paper_problem()
    before, after = compare_designs(paper, paper.start, design)
    compared = draw_compared(ComparedRequest(without_name(design))).measurements
    assert compared is not None
    studied = measure_design(Case(design), SWIFT).values
    path = folder / "design.json"
    path.write_bytes(encode_design(design))
    measured = CommandLine(capsys).answer("workspace", "--design", path)
    return {
        "Compare": {CATALOGUE[name].label: value for name, value in compared.values.items()},
        "Optimise": {CATALOGUE[name].label: after.value(name) for name in after.values},
        "explorer optimise": {
            label: new for label, (_, new) in measure_rows_of_command(before, after)
        },
        "Studies": {label_of(name): value for name, value in studied.items()},
        "explorer workspace": {
            each.label: measured[name]
            for name, each in measures_in("workspace").items()
            if name in measured
        },
        "report": {
            CATALOGUE[name].label: value
            for name, value in ReportData(design).measurements.values.items()
        },
    }


@pytest.mark.parametrize("design", [found(), PRESETS["paper-optimal"]], ids=lambda each: each.name)
def test_measures_of_one_label_have_one_value(
    design: Design, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    by_name: dict[str, dict[str, float]] = {}
    for place, values in values_of_places(design, tmp_path, capsys).items():
        for name, value in values.items():
            if value is not None and math.isfinite(value):
                by_name.setdefault(name, {})[place] = value
    shared = {name: values for name, values in by_name.items() if len(values) > 1}
    assert {"volume", "reach", "longest leg", "nodes", "node volume", "clearance"} <= {*shared}
    for name, values in shared.items():
        first, *others = values.values()
        assert others == pytest.approx([first] * len(others), rel=1e-9), (name, values)


def test_demanded_clearance_of_an_optimised_design_counts_nearer_to_singular_planes() -> None:
    paper = paper_problem()
    _, after = compare_designs(paper, paper.start, found())
    demanded, own = after["demanded_clearance"], after["least_clearance"]
    assert demanded is not None
    assert own is not None
    assert own > demanded


DESIGN = PRESETS["paper-optimal"]
NEW = Measure(
    "base_area",
    "area of the base",
    "Area of the triangle a1, a2, a3 for a unit of the guide",
    lambda case: 0.5 * abs(case.design.a3[1]),
    power=2,
    sense="less",
)
AREA = 0.5 * DESIGN.a3[1]


@pytest.fixture(autouse=True)
def _with_entry(monkeypatch: pytest.MonkeyPatch) -> None:  # pyright: ignore[reportUnusedFunction]
    assert isinstance(CATALOGUE, dict)
    monkeypatch.setitem(CATALOGUE, NEW.name, NEW)


def study() -> Study:
    return study_around(DESIGN, StudyPlan(count=16).with_measure_advanced(NEW.name), "areas")


def test_compare_lists_a_new_measure() -> None:
    measured = measure_design(Case(DESIGN), measures_in("compare"))
    html = table([ComparedDesign(0, DESIGN, measured, UNITS)])
    assert f"{NEW.label} " in html
    assert "units²" in html
    assert f"{AREA:.4f}" in html


def test_optimiser_table_lists_a_new_measure() -> None:
    _, after = compare_designs(paper_problem(), DESIGN, DESIGN)
    assert after[NEW.name] == AREA


def test_study_accepts_a_new_measure() -> None:
    known = study()
    assert decode_study(encode_study(known), "the study") == known
    rows = evaluate(encode_study(known), 0, 2).columns
    assert rows[NEW.name] == [pytest.approx(0.5 * abs(float(y or 0.0))) for y in rows["a3y"]]
    assert title_of(NEW.name, UNITS) == f"{NEW.label} [units²]"
    assert NEW.hint in chips(StudyPlan(), DESIGN, UNITS)


def test_report_lists_a_new_measure() -> None:
    page = read(make_report(DESIGN).decode())
    assert f"{NEW.label.capitalize()}{AREA:.4f} units²" in page.one(**{"class": "headline"}).text
    assert AREA in page.one(**{"class": "headline"}).values


def test_optimise_command_prints_a_new_measure(capsys: pytest.CaptureFixture[str]) -> None:
    cli = CommandLine(capsys, ("optimise", "--design", DESIGN.name), has_progress=True)
    page = cli.text("--objective", "match-volume", "--target-volume", 7100)
    (line,) = (line for line in page.splitlines() if line.startswith(NEW.label))
    first, *_ = line.removeprefix(NEW.label).split()
    assert float(first) == pytest.approx(AREA, abs=1e-3)


def test_workspace_command_answers_a_new_measure(capsys: pytest.CaptureFixture[str]) -> None:
    cli = CommandLine(capsys, ("workspace", "--design", DESIGN.name, "--tolerance", "0.5"))
    assert cli.answer()[NEW.name] == AREA
    assert f"{NEW.label} {AREA:.5f} units²" in " ".join(cli.text().split())
