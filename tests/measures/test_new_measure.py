"""A measure is added by one entry of the catalogue: every place that lists measures has it."""

from __future__ import annotations

import pytest
from command_line import CommandLine
from report_page import read

from explorer.app.features.compare.columns import Column
from explorer.app.features.compare.table import table
from explorer.app.features.optimise.tasks import compare
from explorer.app.features.optimise.words import measure_rows
from explorer.app.features.sharing.reporting import make_report
from explorer.app.features.studies.words import chips
from explorer.app.state.studies import StudyPlan, study_around, title_of
from explorer.measures.case import Case
from explorer.measures.catalogue import CATALOGUE, Measure, measures_in
from explorer.measures.measurements import measure_design
from explorer.mechanism.design_file import PRESETS
from explorer.optimise.defaults import make_problem
from explorer.sweep.rows import evaluate
from explorer.sweep.study import Study, decode_study, encode_study

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
    html = table([Column(0, DESIGN, measured, 1.0)], millimetres=False)
    assert f"{NEW.label} " in html
    assert "units²" in html
    assert f"{AREA:.4f}" in html


def test_optimiser_table_lists_a_new_measure() -> None:
    both = compare(DESIGN, DESIGN, None, (None, None))
    problem = make_problem(DESIGN, "largest-volume")
    rows = {row.name: row for row in measure_rows(problem, both.before, both.after)}
    assert rows[f"{NEW.label}, units²"].after == AREA


def test_study_accepts_a_new_measure() -> None:
    known = study()
    assert decode_study(encode_study(known), "the study") == known
    rows = evaluate(encode_study(known), 0, 2).columns
    assert rows[NEW.name] == [pytest.approx(0.5 * abs(float(y or 0.0))) for y in rows["a3y"]]
    assert title_of(NEW.name) == f"{NEW.label} [units²]"
    assert NEW.hint in chips(StudyPlan(), DESIGN)


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
    assert f"{NEW.label}  {AREA:.5f} units²" in cli.text()
