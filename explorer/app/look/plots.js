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
  // Value at a height from 0 to 1 of an axis of the parallel lines.
  const valueAt = ([low, high, isLogarithmic], share) =>
    isLogarithmic ? low * (high / low) ** share : low + share * (high - low);
  // Design whose line passes nearest to a point of the window; null if none is near.
  const designAt = (plot, x, y) => {
    const { xaxis, yaxis } = plot._fullLayout,
      box = plot.querySelector(".nsewdrag").getBoundingClientRect();
    const count = plot.layout.meta.axes.length,
      place = xaxis.p2l(x - box.x),
      first = Math.floor(place);
    if (first < 0 || first > count - 2) return null;
    const run = xaxis.l2p(1) - xaxis.l2p(0);
    let nearest = null,
      least = 6;
    for (const { customdata, y: heights } of plot._fullData) {
      customdata?.forEach((design, line) => {
        const at = line * (count + 1) + first;
        const start = yaxis.l2p(heights[at]),
          rise = yaxis.l2p(heights[at + 1]) - start;
        const above = start + rise * (place - first) - (y - box.y);
        const away = Math.abs(above) * (run / Math.hypot(run, rise));
        if (away < least) [nearest, least] = [Number(design), away];
      });
    }
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
      plot.addEventListener("pointerdown", (e) => (pressed = [e.clientX, e.clientY]), true);
      // Plotly covers the page during a press, so that no click reaches the plot.
      addEventListener("pointerup", ({ clientX: x, clientY: y }) => {
        const isClick = pressed && Math.hypot(x - pressed[0], y - pressed[1]) <= 4;
        pressed = null;
        const index = isClick ? designAt(plot, x, y) : null;
        if (index !== null) tell(plot, { index });
      });
      plot.on("plotly_selected", (event) => {
        if (!event?.range) return;
        const { axes, ends } = plot.layout.meta;
        const [left, right] = ordered(event.range.x),
          heights = ordered(event.range.y);
        // The axes in the box, or else the one beside it.
        const nearest = Math.round((left + right) / 2);
        const isIn = (k) => (k >= left && k <= right) || k === nearest;
        const brushes = axes.flatMap((axis, k) =>
          isIn(k) ? [{ axis, ranges: [heights.map((each) => valueAt(ends[k], each))] }] : [],
        );
        tell(plot, { brushes });
      });
      plot.on("plotly_deselect", () =>
        brush(
          plot,
          plot.layout.meta.axes.map(() => []),
        ),
      );
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
