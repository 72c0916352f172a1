"""The prototype: parts that can be made, in place of the schematic ones."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import viser

from explorer.app.features.feature import Export, Feature, Services, Tab
from explorer.app.features.prototype import work
from explorer.app.features.prototype.scene import PrototypeScene
from explorer.app.features.prototype.work import PARTS_FEED, Parts, PartsFeed, parts_to_draw
from explorer.app.inputs.controls import Bound, Controls
from explorer.app.inputs.ranges import Span
from explorer.app.session.session import Who
from explorer.app.state.actions import Set, draw_as
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import alert, box, caption, note, row, sentence, table
from explorer.errors import ExplorerError, TooTightError
from explorer.mechanism.design import LENGTHS
from explorer.numerics.number_text import format_decimals, format_number
from explorer.prototype.assembly import Actuator
from explorer.prototype.fitting import broken_joint_limits

# Format of each file by its name on the page, and end of the name of the file.
ASSEMBLIES = {
    "3MF": ("3mf", "mechanism.3mf"),
    "GLB": ("glb", "mechanism.glb"),
    "STL (zip)": ("stl-zip", "parts-stl.zip"),
    "STEP": ("step", "mechanism.step"),
}
FIT = "prototype.fit"


class PrototypePanel:
    """Controls that draw, explode and list the parts."""

    def __init__(self, services: Services) -> None:
        gui, self._feed = services.gui, services.get(PARTS_FEED)
        self._controls = controls = Controls(gui, services.session)
        controls.checkbox(
            "Show the parts",
            "Draw the mechanism as parts that can be made: sized from the design, the radii of "
            "its legs and its unit.",
            Bound(
                lambda frame: frame.state.view.drawn_as == "prototype",
                lambda _, on: draw_as("prototype" if on else "schematic"),
            ),
        )
        gui.add_html(note("Sized from the design; Export has them for printers and CAD."))
        self._trouble = gui.add_html("", visible=False)
        self._session = services.session
        services.buttons.on(FIT, self._set_fitting_unit)
        self._folder = gui.add_folder("Parts", visible=False)
        with self._folder:
            controls.slider(
                "Exploded",
                "The exploded view: 0 together, 1 each part by itself.",
                "view.prototype.exploded",
                Span(0.0, 1.0, 0.01),
            )
            controls.number(
                "Density (kg/m³)",
                "Density of all parts. Aluminium 2700, steel 7850, printed PLA 1240.",
                "view.prototype.density",
                least=1.0,
                step=1.0,
            )
            self._bill = gui.add_html("")

    def _set_fitting_unit(self, _: str, client: viser.ClientHandle) -> None:
        fitting = _fitting_unit_mm(self._feed)
        if fitting is not None:
            unit = Set("design.unit_mm", fitting, "1 unit (mm)")
            self._session.do(unit, who=client.client_id)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        feed = self._feed
        yield from self._controls.updates(frame)
        trouble = trouble_of(frame, feed)
        yield self._trouble, "visible", trouble is not None
        if trouble is not None:
            yield self._trouble, "content", trouble
        # A failure in the worker takes the parts away at any time.
        parts = parts_to_draw(feed)
        yield self._folder, "visible", parts is not None
        if parts is not None:
            density = frame.state.view.prototype.density
            yield self._bill, "content", parts_table(parts, density)


def _fitting_unit_mm(feed: PartsFeed) -> float | None:
    """Return the mm in a design unit with which the parts fit; None if they do, or none helps."""
    return feed.drawing.fitting_unit_mm if isinstance(feed.drawing, TooTightError) else None


def trouble_of(frame: Frame, feed: PartsFeed) -> str | None:
    """Return as HTML why there are no parts or why they cannot take the pose; None if they can."""
    if frame.state.view.drawn_as != "prototype":
        return None
    if feed.problem is not None:
        return alert("The parts could not be made", feed.problem)
    drawing = feed.drawing
    if isinstance(drawing, ExplorerError):
        refusal = alert("No prototype of this design", sentence(str(drawing)))
        unit = _fitting_unit_mm(feed)
        if unit is None:
            return refusal
        fit = press_button(
            FIT,
            "",
            f"Set the unit to {format_number(unit)} mm",
            hint="The least size at which there is room for the parts.",
            class_name="ex-button",
        )
        return refusal + box(fit)
    if drawing is None:
        return note("Making the parts …")
    broken = broken_joint_limits(
        drawing.prototype.sizes, frame.state.pose.position, frame.snapshot.rotation
    )
    return alert("The parts do not take this pose", sentence("; ".join(broken))) if broken else None


def parts_table(parts: Parts, density: float) -> str:
    """Return the bill of materials as HTML: parts, then actuators; the density is in kg/m³."""
    rows = (
        row(
            escape(line.name),
            f"{line.count}",
            f'<span class="ex-whole">{"Ø " * (len(line.stock) == 2)}'
            f"{' × '.join(map(_mm, line.stock))}</span>",
            _grams(line.mass(density)),
        )
        for line in parts.lines
    )
    actuators = (
        row(
            f"{LENGTHS[actuator.leg - 1]}, leg {actuator.leg}",
            _mm(actuator.stroke.shortest),
            _mm(actuator.stroke.longest),
            _mm(actuator.stroke.longest - actuator.stroke.shortest),
            hint=f"The limits allow {_mm(actuator.required.shortest)} "
            f"to {_mm(actuator.required.longest)} mm",
        )
        for actuator in parts.actuators
    )
    moving = sum(line.mass(density) for line in parts.lines if line.kind != "base")
    mass = sum(line.mass(density) for line in parts.lines)
    remark = "The limits allow a longer stroke than one rod in its cylinder has."
    return box(
        f'<div class="ex-status">{_mass(mass)}</div>',
        caption(f"all parts; without the base {_mass(moving)}"),
        table(rows, ("part", "count", "stock, mm", "mass, g")),
        table(actuators, ("actuator", "shortest", "longest", "stroke, mm")),
        ""
        if all(map(_is_enough, parts.actuators))
        else f'<div class="ex-dim ex-after">{remark}</div>',
    )


def _is_enough(actuator: Actuator) -> bool:
    """Whether a stroke covers the one that the limits allow, but for the last bits."""
    needed, stroke = actuator.required, actuator.stroke
    slack = 1e-9 * needed.longest
    return stroke.shortest <= needed.shortest + slack and stroke.longest >= needed.longest - slack


def _mm(value: float) -> str:
    return format_decimals(value, 1)


def _grams(value: float) -> str:
    return format_decimals(value, 1 if value < 1000.0 else 0)


def _mass(grams: float) -> str:
    return f"{_grams(grams)} g" if grams < 1000.0 else f"{format_number(grams / 1000.0)} kg"


def _send_assembly(services: Services, name: str, who: Who) -> None:
    design = services.session.latest_state().design
    file_format, end = ASSEMBLIES[name]
    file = f"{design.name}-{end}"
    services.downloads.compute(who, file, work.export_assembly, (design, file_format))


def _send_simulation(services: Services, who: Who) -> None:
    state = services.session.latest_state()
    file = f"{state.design.name}-simulation.xml"
    arguments = state.design, state.view.prototype.density
    services.downloads.compute(who, file, work.export_simulation, arguments)


def _floor(services: Services) -> float | None:
    parts = parts_to_draw(services.get(PARTS_FEED))
    return None if parts is None else parts.floor


PROTOTYPE = Feature(
    "prototype",
    tabs=(Tab("analyse", "Prototype", PrototypePanel, viser.Icon.ENGINE),),
    exports=(
        Export(
            "Mechanism",
            "Parts that can be made, assembled in the home pose, in millimetres.",
            tuple(ASSEMBLIES),
            lambda services: lambda name, who: _send_assembly(services, name, who),
        ),
        Export(
            "Simulation",
            "A model with joints, masses and servos for MuJoCo and other physics engines.",
            ("MJCF",),
            lambda services: lambda _, who: _send_simulation(services, who),
        ),
    ),
    scene=(PrototypeScene,),
    feeds=(PARTS_FEED,),
    floor=_floor,
)
