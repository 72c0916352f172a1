// Reports brushes and picks in the plots of studies as presses of "studies.plot".
window.explorer.plots ??= (() => {
  const tell = (plot, event) => {
    const line = JSON.stringify({ study: plot.layout.meta.study, ...event });
    window.explorer.press("studies.plot", line);
  };
  const brush = (plot, ranges) => {
    const brushes = plot.layout.meta.axes.map((axis, k) => ({ axis, ranges: ranges[k] }));
    tell(plot, { brushes });
  };
  const ordered = ([a, b]) => (a <= b ? [a, b] : [b, a]);
  const rangesOf = ({ constraintrange: given }) =>
    !given || !given.length ? [] : Array.isArray(given[0]) ? given : [given];
  // Row of the line within all brushes that passes nearest to a point of the window; null if none.
  const lineAt = (plot, x, y) => {
    const brushes = plot.querySelectorAll(".axis-brush .background");
    const axes = plot._fullData[0].dimensions.map((dimension, k) => {
      const {
          values,
          range: [low, high],
        } = dimension,
        ranges = rangesOf(dimension);
      const box = brushes[k].getBoundingClientRect();
      const at = (row) => box.bottom - (box.height * (values[row] - low)) / (high - low);
      const isIn = (row) =>
        !ranges.length || ranges.some(([a, b]) => values[row] >= a && values[row] <= b);
      return { at, isIn, x: box.x + box.width / 2 };
    });
    const inOrder = axes.toSorted((a, b) => a.x - b.x);
    const next = inOrder.findIndex((axis) => axis.x >= x);
    if (next < 1) return null;
    const [from, to] = [inOrder[next - 1], inOrder[next]];
    let nearest = null,
      least = 6;
    plot.layout.meta.designs.forEach((_, row) => {
      const start = from.at(row),
        rise = to.at(row) - start,
        run = to.x - from.x;
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
        if (Number.isInteger(index)) tell(plot, { index });
      });
      plot.on("plotly_selected", (event) => {
        if (!event || !event.range) return;
        const { x, y } = event.range;
        brush(plot, [[ordered(x)], [ordered(y)]]);
      });
      plot.on("plotly_deselect", () => brush(plot, [[], []]));
    },
    parallel(plot) {
      let pressed = null;
      plot.addEventListener("mousedown", (e) => (pressed = [e.clientX, e.clientY]), true);
      plot.addEventListener("click", (e) => {
        if (!e.target.classList.contains("gl-canvas") || !pressed) return;
        if (Math.hypot(e.clientX - pressed[0], e.clientY - pressed[1]) > 4) return;
        const row = lineAt(plot, e.clientX, e.clientY);
        if (row !== null) tell(plot, { index: plot.layout.meta.designs[row] });
      });
      plot.on("plotly_restyle", ([changes]) => {
        for (const key of Object.keys(changes)) {
          const found = key.match(/^dimensions\[(\d+)\]\.constraintrange$/);
          if (!found) continue;
          const dimension = plot.data[0].dimensions[Number(found[1])];
          const ranges = rangesOf(dimension).map((each) => ordered(Array.from(each)));
          tell(plot, { brushes: [{ axis: dimension.name, ranges }] });
        }
      });
    },
  };
  // Milliseconds after which a plot that is not drawn yet is looked at again.
  const AGAIN = 150;
  let timer = null;
  const look = () => {
    for (const plot of document.querySelectorAll(".js-plotly-plot")) {
      const meta = plot.layout?.meta;
      if (!plot.on) timer ??= window.explorer.clock.after(AGAIN, lookAgain);
      else if (!plot.explorerListens && listen[meta?.explorer]) {
        plot.explorerListens = true;
        listen[meta.explorer](plot);
      }
    }
  };
  const lookAgain = () => {
    timer = null;
    look();
  };
  // Plots come and go with their tab, and searching the page for them is cheap.
  new MutationObserver(look).observe(document.body, { childList: true, subtree: true });
  look();
  return true;
})();
