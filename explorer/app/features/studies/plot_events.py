"""What hands do in the plots of a study, and how the server hears of it.

viser's plots tell the server nothing. A script of ours, which is the same for everybody and
holds nothing of anybody's data, listens to the plots and writes what happens as one line of
JSON into a text input out of sight. So it comes as any other input does, past the same
guard, and is read here as strictly. Nothing is drawn by the script: brushes and picks are
drawn by the server, for every tab.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from explorer.app.features.studies.actions import MOST_RANGES

# No honest line is longer.
LONGEST_LINE = 4000

Word = Annotated[str, msgspec.Meta(max_length=200)]
Range = tuple[float, float]
Ranges = Annotated[tuple[Range, ...], msgspec.Meta(max_length=MOST_RANGES)]
Serial = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Index = Annotated[int, msgspec.Meta(ge=0, le=2**31)]


class Event(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="do"):
    """Something that was done in a plot.

    Attributes:
        study: The name of the study that it was done in.
        serial: Another one each time, or the input would not change.
    """

    study: Word
    serial: Serial


class Picked(Event, frozen=True, tag="pick"):
    """A design was clicked."""

    index: Index


class Brushed(Event, frozen=True, tag="brush"):
    """An axis of the parallel lines was brushed; without ranges it was freed."""

    axis: Word
    ranges: Ranges


class Boxed(Event, frozen=True, tag="box"):
    """A box was drawn in the scatter plot; without one both axes were freed."""

    axes: tuple[Word, Word]
    box: tuple[Range, Range] | None


_DECODER = msgspec.json.Decoder(Picked | Brushed | Boxed)


def event_of(line: str) -> Picked | Brushed | Boxed | None:
    """Return what a line tells; None if it is none of the script's."""
    if len(line) > LONGEST_LINE:
        return None
    try:
        return _DECODER.decode(line)
    except (msgspec.MsgspecError, UnicodeEncodeError, RecursionError):
        return None


SCRIPT = """
(() => {
  if (window.explorerPlots) return;
  let serial = Date.now() * 100;
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const inputOf = (uuid) => {
    let box = document.querySelector(`label[for="${CSS.escape(uuid)}"]`);
    while (box && !box.querySelector("input")) box = box.parentElement;
    return box && box.querySelector("input");
  };
  const tell = (plot, event) => {
    const meta = plot.layout.meta, input = inputOf(meta.inbox);
    if (!input) return;
    const line = JSON.stringify({ study: meta.study, serial: (serial += 1), ...event });
    write.call(input, line);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const ordered = ([a, b]) => (a <= b ? [a, b] : [b, a]);
  const rangesOf = ({ constraintrange: given }) =>
    !given || !given.length ? [] : Array.isArray(given[0]) ? given : [given];
  // The line that passes a place of the window nearest, out of those within all brushes.
  const lineAt = (plot, x, y) => {
    const brushes = plot.querySelectorAll(".axis-brush .background");
    const axes = plot._fullData[0].dimensions.map((dimension, k) => {
      const { values, range: [low, high] } = dimension, ranges = rangesOf(dimension);
      const box = brushes[k].getBoundingClientRect();
      const at = (row) => box.bottom - (box.height * (values[row] - low)) / (high - low);
      const isIn = (row) =>
        !ranges.length || ranges.some(([a, b]) => values[row] >= a && values[row] <= b);
      return { at, isIn, x: box.x + box.width / 2 };
    });
    const inOrder = [...axes].sort((a, b) => a.x - b.x);
    const next = inOrder.findIndex((axis) => axis.x >= x);
    if (next < 1) return null;
    const [from, to] = [inOrder[next - 1], inOrder[next]];
    let nearest = null, least = 6;
    plot.layout.meta.designs.forEach((_, row) => {
      const start = from.at(row), rise = to.at(row) - start, run = to.x - from.x;
      const above = start + (rise * (x - from.x)) / run - y;
      const away = Math.abs(above) * (run / Math.hypot(run, rise));
      if (away < least && axes.every((axis) => axis.isIn(row))) [nearest, least] = [row, away];
    });
    return nearest;
  };
  const listen = {
    scatter(plot) {
      plot.on("plotly_click", ({ points }) => {
        const index = Number(points[points.length - 1].customdata);
        if (Number.isInteger(index)) tell(plot, { do: "pick", index });
      });
      plot.on("plotly_selected", (event) => {
        if (!event || !event.range) return;
        const box = [ordered(event.range.x), ordered(event.range.y)];
        tell(plot, { do: "box", axes: plot.layout.meta.axes, box });
      });
      plot.on("plotly_deselect", () =>
        tell(plot, { do: "box", axes: plot.layout.meta.axes, box: null }),
      );
    },
    parallel(plot) {
      let pressed = null;
      plot.addEventListener("mousedown", (e) => (pressed = [e.clientX, e.clientY]), true);
      plot.addEventListener("click", (e) => {
        if (!e.target.classList.contains("gl-canvas") || !pressed) return;
        if (Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) > 4) return;
        const row = lineAt(plot, e.clientX, e.clientY);
        if (row !== null) tell(plot, { do: "pick", index: plot.layout.meta.designs[row] });
      });
      plot.on("plotly_restyle", ([changes]) => {
        for (const key of Object.keys(changes)) {
          const found = key.match(/^dimensions\\[(\\d+)\\]\\.constraintrange$/);
          if (!found) continue;
          const dimension = plot.data[0].dimensions[Number(found[1])];
          const ranges = rangesOf(dimension).map((each) => ordered(Array.from(each)));
          tell(plot, { do: "brush", axis: dimension.name, ranges });
        }
      });
    },
  };
  // Plots come and go with their tab; a look at those that are there costs next to nothing.
  window.explorerPlots = setInterval(() => {
    for (const plot of document.querySelectorAll(".js-plotly-plot")) {
      const meta = plot.layout && plot.layout.meta;
      if (plot.explorerListens || !meta || !listen[meta.explorer] || !plot.on) continue;
      plot.explorerListens = true;
      listen[meta.explorer](plot);
    }
  }, 150);
})();
"""
"""Listens to the plots of studies in a browser."""
