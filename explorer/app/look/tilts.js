// Reads the polar map of tilts under the pointer; a click tilts the platform there, as a press of
// "orientation.go".
window.explorer.tilts ??= (() => {
  const HINT = "Point at the map to read it, click to tilt there.";
  const mapAt = (target) => target.closest?.("[data-tilts]") ?? null;
  const anglesAt = (map, { clientX, clientY }) => {
    const matrix = map.getScreenCTM();
    if (!matrix) return null;
    const at = new DOMPoint(clientX, clientY).matrixTransform(matrix.inverse());
    const { centre, radius, edge } = JSON.parse(map.dataset.tilts);
    const [x, y] = [at.x - centre[0], centre[1] - at.y];
    const tilt = (edge * Math.hypot(x, y)) / radius;
    if (tilt > edge) return null;
    return [(Math.atan2(y, x) * 180) / Math.PI, tilt].map((angle) => Number(angle.toFixed(1)));
  };
  const words = (angles) =>
    `azimuth ${angles[0].toFixed(1)}°, tilt ${angles[1].toFixed(1)}°`.replace("-", "\u2212");
  let last = null;
  const show = () => {
    const map = last && mapAt(last.target);
    const reading = map?.parentElement?.querySelector(".ex-reading");
    if (!reading) return;
    const angles = anglesAt(map, last);
    reading.textContent = angles ? words(angles) : HINT;
  };
  addEventListener("pointermove", ({ target, clientX, clientY }) => {
    const left = last?.target.isConnected && mapAt(last.target);
    last = mapAt(target) ? { target, clientX, clientY } : null;
    const reading = !last && left && left.parentElement?.querySelector(".ex-reading");
    if (reading) reading.textContent = HINT;
    show();
  });
  // The map is drawn anew while the mechanism moves; its reading stays.
  new MutationObserver(() => {
    if (!last || last.target.isConnected) return;
    const target = document.elementFromPoint(last.clientX, last.clientY);
    last = target && mapAt(target) ? { ...last, target } : null;
    show();
  }).observe(document.body, { childList: true, subtree: true });
  addEventListener("click", (event) => {
    const map = mapAt(event.target),
      // A click tells whole pixels, other than the pointer that read the map.
      angles = map && anglesAt(map, last ?? event);
    if (angles) window.explorer.press("orientation.go", JSON.stringify(angles));
  });
  return { anglesAt };
})();
