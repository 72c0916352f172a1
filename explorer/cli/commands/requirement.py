"""`explorer check` and `explorer find`: what a machine must do, and machines that do it."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from explorer.cli import options, output, values
from explorer.cli.streams import Meter
from explorer.errors import NoAnswerError
from explorer.files.writing import check_writable, make_folder
from explorer.find.answers import DemandCheck, FoundDesign, FoundDesigns, RequirementCheck
from explorer.find.bound import round_down
from explorer.find.check import check_requirement
from explorer.find.nearest import find_or_relax
from explorer.find.requirement import PREFERENCES, Requirement, load_requirement
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import encode_design
from explorer.mechanism.pose import Pose
from explorer.numerics.interruption import Interruption
from explorer.numerics.number_text import format_ascii


@dataclass(frozen=True, kw_only=True)
class CheckCommand(options.JsonOptions, options.DesignOptions):
    """Check a design against a requirement: each demand, its worst value and pose.

    The demands hold over the box and at every tilt; each is proven, or no violation was found in so
    many poses. If one is missed, the exit status is 1.
    """

    requirement: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """Requirement file (JSON)."""

    def run(self) -> None:
        """Write the demands with their worst values."""
        requirement, design = load_requirement(self.requirement), self.read_design()
        check = check_requirement(design, requirement)
        missed = ", ".join(demand.words for demand in check.missed)
        self.write(
            lambda: {
                "kept": check.kept,
                "demands": [demand_json(design, demand) for demand in check.demands],
            },
            check_lines(design, requirement, check),
            [] if check.kept else [NoAnswerError(f"the design misses {missed}")],
        )


@dataclass(frozen=True, kw_only=True)
class FindCommand(options.JsonOptions):
    """Find designs that keep a requirement, each of another kind, the preferred one first.

    Ctrl-C, or SIGTERM, ends the search and keeps what was found. If nothing was found, the exit
    status is 1, and the nearest values that can be reached are told as they are found.
    """

    requirement: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="REQUIREMENT")]
    """Requirement file (JSON)."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")]
    """Folder of the design files, created if it does not exist; a file of the same name is
    replaced."""

    count: Annotated[int, values.whole_number(1, len(PREFERENCES))] = 4
    """Number of designs."""

    seconds: Annotated[float, values.POSITIVE] = 10.0
    """Time of the search, on a usual core."""

    seed: Annotated[int, values.whole_number(0, 2**31 - 1)] = 0
    """Seed of the random machines."""

    design: Annotated[str | None, values.hint("optional", values.DESIGN_NAME)] = None
    """Design to improve in place of random machines."""

    def run(self) -> None:
        """Write the designs that were found."""
        requirement = load_requirement(self.requirement)
        start = None if self.design is None else options.load(self.design)
        make_folder(self.out, 0o777)
        check_writable(self.out / "1.json")
        with Interruption() as interruption:
            found = self._search(requirement, start, interruption)
            names = (f"{i}-{one.kind}.json" for i, one in enumerate(found.designs, 1))
            files = [self.out / name for name in names]
            data = [encode_design(one.design) for one in found.designs]
            written, unwritten = options.write_files(dict(zip(files, data, strict=True)))
        none = [] if found.designs else [NoAnswerError(_reason(found))]
        kept = [file if file in written else None for file in files]
        self.write(
            lambda: found_json(kept, found),
            found_lines(requirement, kept, found),
            [*none, *unwritten],
        )

    def _search(
        self, requirement: Requirement, start: Design | None, interruption: Interruption
    ) -> FoundDesigns:
        """Search with a progress bar until the time is over, or until it is to stop."""
        begun, last = time.monotonic(), [FoundDesigns((), 0.0)]

        def stop() -> bool:
            share = (time.monotonic() - begun) / self.seconds
            meter.show(progress_line(last[-1], is_over=share > 1.0), min(share, 1.0))
            return interruption.is_asked()

        def watch(found: FoundDesigns) -> None:
            last.append(found)
            if found.nearest:
                meter.tell(f"within reach: {found.nearest[-1].words}")
            elif not found.designs:
                meter.tell(_reason(found))

        with Meter() as meter:
            given = output.attributes(self, "count seconds seed")
            return find_or_relax(requirement, design=start, watch=watch, stop=stop, **given)


def progress_line(found: FoundDesigns, *, is_over: bool) -> str:
    """Return the line beside the progress bar, before or after the time of the search is over."""
    if found.designs:
        longest = format_ascii(found.designs[0].longest_mm, 4)
        return f"{_number_of_designs(found)}, longest leg {longest} mm"
    if found.impossible or is_over:
        why = "; ".join(found.impossible) or "no design found"
        return f"{why}: looking for what is within reach"
    return "no design yet"


def _number_of_designs(found: FoundDesigns) -> str:
    count = len(found.designs)
    return f"{count} design{'s' * (count != 1)}"


def demand_json(design: Design, demand: DemandCheck) -> dict[str, object]:
    """Return a demand as plain values, with the position of the tool in its worst pose."""
    return {
        **output.attributes(demand, "name kept worst limit spare unit"),
        "position_mm": None if demand.pose is None else _tool_mm(design, demand.pose),
        "quaternion": None if demand.pose is None else demand.pose.quaternion,
        "proven": demand.proven,
    }


def _tool_mm(design: Design, pose: Pose) -> list[float]:
    """Return the position of a design's tool in a pose, in millimetres."""
    return [design.unit_mm * each for each in tool_position(pose, design.tool.position)]


def found_json(files: Sequence[Path | None], found: FoundDesigns) -> dict[str, object]:
    """Return the answer of a search as plain values; what is impossible is what binds."""
    return {
        "designs": [_design_json(*pair) for pair in zip(files, found.designs, strict=True)],
        "bound_mm": found.bound_mm,
        "binding": [*found.impossible, *found.binding],
        "nearest": [output.attributes(each, "demand value unit") for each in found.nearest],
    }


def _design_json(file: Path | None, found: FoundDesign) -> dict[str, object]:
    design = found.design
    return {
        "file": file,
        "box": {"centre_mm": _tool_mm(design, design.home_pose), "yaw_deg": design.required_yaw},
        "longest_mm": found.longest_mm,
        "largest_utilisation": found.utilisation,
        **output.attributes(found, "clearance_mm transmission error_mm"),
        "proven": found.check.proven,
        "poses_checked": found.check.poses,
    }


def check_lines(design: Design, requirement: Requirement, check: RequirementCheck) -> Iterator[str]:
    """Yield the demands as a table, with the pose in which each is nearest to its limit."""
    yield output.heading(design)
    rows: list[tuple[str, ...]] = [
        ("demand", "worst", "limit", "spare", "", "", "tool in mm, tilt")
    ]
    for demand in check.demands:
        numbers = [_figure(value) for value in (demand.worst, demand.limit, demand.spare)]
        if demand.worst == demand.limit == demand.spare == 0.0:
            numbers = [""] * 3
        verdict = "proven" if demand.proven else "kept" if demand.kept else "missed"
        rows.append((demand.words, *numbers, demand.unit, verdict, _place(design, demand)))
    yield output.table(rows, "<>>><<<")
    kept = len(check.demands) - len(check.missed)
    proven = sum(demand.proven for demand in check.demands)
    yield f"{requirement.name}: {kept} of {len(check.demands)} demands kept, {proven} proven"


def _figure(value: float) -> str:
    return format_ascii(value, 4) if math.isfinite(value) else "infinite"


def _place(design: Design, demand: DemandCheck) -> str:
    """Return where a demand is nearest to its limit, and what was looked at."""
    words = [demand.remark] if demand.remark else []
    if demand.pose is not None:
        turn = demand.pose.rotation @ design.home_pose.rotation.T
        tilt = math.degrees(math.acos(float(np.clip(0.5 * np.trace(turn) - 0.5, -1.0, 1.0))))
        at = " ".join(f"{value:z.1f}" for value in _tool_mm(design, demand.pose))
        words.insert(0, f"{at}, {tilt:z.1f}°")
    return "; ".join(words)


def found_lines(
    requirement: Requirement, files: Sequence[Path | None], found: FoundDesigns
) -> Iterator[str]:
    """Yield the designs as a table, the bound, what binds, and the nearest values."""
    yield f"{requirement.name}: {_number_of_designs(found)}"
    if found.designs:
        rows: list[tuple[str, ...]] = [
            ("", "longest leg", "force for 1 N", "clearance", "transmission", "error", "")
        ]
        for file, one in zip(files, found.designs, strict=True):
            numbers = one.longest_mm, one.force_per_newton, one.clearance_mm, one.transmission
            proof = "proven" if one.check.proven else f"no violation in {one.check.poses} poses"
            rows.append((str(file or one.kind), *map(_figure, (*numbers, one.error_mm)), proof))
        yield output.table(rows, "<>>>>><")
    if 0.0 < found.bound_mm < math.inf:
        yield f"no machine has legs below {round_down(found.bound_mm)} mm"
    if found.binding:
        yield f"binding: {', '.join(found.binding)}"
    yield from (f"within reach: {each.words}" for each in found.nearest)


def _reason(found: FoundDesigns) -> str:
    """Return why nothing was found."""
    nearest = ", or ".join(each.words for each in found.nearest)
    reason = "; ".join(found.impossible) or "no design was found that keeps the requirement"
    return f"{reason}; within reach: {nearest}" if nearest else reason
