"""One measure has one value: two places that list a label list the same value."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import pytest
from command_line import CommandLine

from explorer.app.features.compare.drawing import ComparedRequest, compared_drawing
from explorer.app.features.optimise.tasks import compare
from explorer.app.features.optimise.words import measure_rows
from explorer.app.state.compared import unnamed
from explorer.app.state.studies import label_of
from explorer.cli.answers.optimisation import measure_rows as measure_rows_of_command
from explorer.export.report.data import gather_report_data
from explorer.measures.case import Case
from explorer.measures.catalogue import CATALOGUE, measures_in
from explorer.measures.measurements import measure_design
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, encode_design
from explorer.optimise.defaults import make_problem
from explorer.optimise.paper import paper_start
from explorer.optimise.problem import Problem

pytestmark = pytest.mark.usefixtures("warm_kernels")

Places = dict[str, dict[str, float | None]]

SWIFT = [name for name, each in measures_in("studies").items() if each.cost == "low"]
BOX = ((9.0, 4.0, 8.0), (11.0, 6.0, 10.0))


def problem() -> Problem:
    """Return the paper's problem, with a required box."""
    return make_problem(
        paper_start(), "match-volume", volume=8000.0, clearance=0.2, required_box=BOX
    )


def found() -> Design:
    """Return a design that solves it: of twice the reach of the start, on whose grid it is not."""
    values = [19.056, 9.5175, 2.027, -4.7727, 5.5619, 4.7706]
    return msgspec.structs.replace(paper_start().with_variables(values), name="found")


def values_of_places(design: Design, folder: Path, capsys: pytest.CaptureFixture[str]) -> Places:
    """Return the values that each place shows of a design, by place and label."""
    paper = problem()
    margin = paper.demands.clearance_margin
    both = compare(paper.start, design, margin, (BOX, BOX))
    compared = compared_drawing(ComparedRequest(unnamed(design))).measurements
    assert compared is not None
    studied = measure_design(Case(design), SWIFT).values
    path = folder / "design.json"
    path.write_bytes(encode_design(design))
    measured = CommandLine(capsys).answer("workspace", "--design", path)
    return {
        "Compare": {CATALOGUE[name].label: value for name, value in compared.values.items()},
        "Optimise": {
            row.name.removesuffix(", units³").removesuffix(", units"): row.after
            for row in measure_rows(paper, both.before, both.after)
        },
        "explorer optimise": {
            label: after for label, (_, after) in measure_rows_of_command(both.before, both.after)
        },
        "Studies": {label_of(name): value for name, value in studied.items()},
        "explorer workspace": {
            each.label: measured[name]
            for name, each in measures_in("workspace").items()
            if name in measured
        },
        "report": {
            CATALOGUE[name].label: value
            for name, value in gather_report_data(design).measured.values.items()
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


def test_optimised_design_lists_its_demanded_clearance_beside_its_own() -> None:
    paper = problem()
    both = compare(paper.start, found(), paper.demands.clearance_margin, (None, None))
    rows = {row.name: row for row in measure_rows(paper, both.before, both.after)}
    demanded, own = rows["demanded clearance, |δ| ≥ 0.539"], rows["clearance, units"]
    assert demanded.after == both.after["demanded_clearance"]
    assert own.after == both.after["least_clearance"]
    # It was demanded nearer to the singular planes than where the design's own counts.
    assert demanded.after is not None
    assert own.after is not None
    assert own.after > demanded.after
    free = msgspec.structs.replace(
        paper, demands=msgspec.structs.replace(paper.demands, clearance=None)
    )
    names = [row.name for row in measure_rows(free, both.before, both.after)]
    assert [name for name in names if "clearance" in name] == ["clearance, units"]
