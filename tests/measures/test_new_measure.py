"""A measure is added by one entry of the catalogue: every place that lists measures has it."""

from __future__ import annotations

import pytest

from explorer.app.features.compare.columns import Column
from explorer.app.features.compare.table import table
from explorer.app.features.optimise.tasks import compare
from explorer.app.features.optimise.words import measure_rows
from explorer.app.features.studies.words import chips
from explorer.app.state.studies import StudyWish, study_around, titled
from explorer.cli import run
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
    return study_around(DESIGN, StudyWish(count=16).with_measure_turned(NEW.name), "areas")


def test_compare_lists_a_new_measure() -> None:
    measured = measure_design(Case(DESIGN), measures_in("compare"))
    html = table([Column(0, DESIGN, measured, 1.0)], [], millimetres=False)
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
    assert titled(NEW.name) == f"{NEW.label} [units²]"
    assert NEW.hint in chips(StudyWish(), {}, {NEW.name: "1"})


def test_command_line_prints_a_new_measure(capsys: pytest.CaptureFixture[str]) -> None:
    problem = ["--objective", "match-volume", "--target-volume", "7100"]
    assert run(["optimise", "--design", DESIGN.name, *problem]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith(NEW.label)]
    (cells,) = (line.removeprefix(NEW.label).split() for line in lines)
    assert float(cells[0]) == pytest.approx(AREA, abs=1e-3)
