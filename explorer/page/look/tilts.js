// Reads the polar map of tilts under the pointer; a click tilts the platform there.
window.explorer.tilts ??= (() => {
  const CHART = "[data-tilts]";
  const chartAt = (target) => target.closest?.(CHART) ?? null;
  const rounded = (angle) => Number(angle.toFixed(1));
  const text = (angle) => `${angle.toFixed(1)}°`.replace("-", "\u2212");
  const pointIn = (chart, { clientX, clientY }) => {
    const matrix = chart.getScreenCTM();
    return matrix && new DOMPoint(clientX, clientY).matrixTransform(matrix.inverse());
  };
  const tiltAt = (chart, at) => {
    const { centre, radius, edge } = JSON.parse(chart.dataset.tilts);
    const [x, y] = [at.x - centre[0], centre[1] - at.y];
    const tilt = (edge * Math.hypot(x, y)) / radius;
    if (tilt > edge) return null;
    const angles = [(Math.atan2(y, x) * 180) / Math.PI, tilt].map(rounded);
    return { angles, words: `azimuth ${text(angles[0])}, tilt ${text(angles[1])}` };
  };
  const read = (chart, event) => {
    const at = pointIn(chart, event);
    return at && tiltAt(chart, at);
  };
  let last = null;
  const show = () => {
    const chart = last && chartAt(last.target);
    if (chart) window.explorer.tell(chart, read(chart, last)?.words);
  };
  addEventListener("pointermove", ({ target, clientX, clientY }) => {
    const left = last?.target.isConnected && chartAt(last.target);
    last = chartAt(target) ? { target, clientX, clientY } : null;
    if (left && left !== (last && chartAt(target))) window.explorer.tell(left);
    show();
  });
  // A chart changes while the mechanism moves, and its reading with it.
  const CHANGES = { childList: true, subtree: true };
  new MutationObserver(() => {
    if (!last) return;
    const target = document.elementFromPoint(last.clientX, last.clientY);
    last = target && chartAt(target) ? { ...last, target } : null;
    show();
  }).observe(document.body, { ...CHANGES, attributeFilter: ["data-tilts"] });
  addEventListener("click", (event) => {
    const chart = chartAt(event.target),
      // A click tells whole pixels, other than the pointer that read the same chart.
      isRead = last && chartAt(last.target) === chart,
      found = chart && read(chart, isRead ? last : event);
    if (found) window.explorer.press("orientation.go", JSON.stringify(found.angles));
  });
  return { read };
})();
