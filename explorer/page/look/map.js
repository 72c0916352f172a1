// Shows what the server reads at the pointer on a map: it is sent the position as a press of "NAME.read"
// by the name of the map, and answers with a call. A click goes there, as a press of "NAME.go".
window.explorer.map ??= (() => {
  const mapAt = (target) => target?.closest?.("[data-map]") ?? null;
  // The position at a place of the window over a map, on both axes, and on that of the level of a
  // slice; null beside its frame or the circle around its origin.
  const positionAt = (map, facts, { clientX, clientY }) => {
    const matrix = map.getScreenCTM();
    if (!matrix) return null;
    const at = new DOMPoint(clientX, clientY).matrixTransform(matrix.inverse());
    const [left, bottom, scale] = facts.place;
    const p = [facts.lows[0] + (at.x - left) / scale, facts.lows[1] + (bottom - at.y) / scale];
    if (p.some((value, k) => value < facts.lows[k] || value > facts.highs[k])) return null;
    if (Math.hypot(...p) > (facts.radius ?? Infinity)) return null;
    if (facts.level !== undefined) p.splice(facts.axis, 0, facts.level);
    // A pixel is wider than the last decimal.
    return p.map((value) => Number(value.toFixed(facts.decimals)));
  };
  const placeOf = (facts, target) => {
    if (target.classList.contains("is-colliding")) return ", legs collide";
    if (target.classList.contains("is-blocked")) return `, ${facts.leftOut}`;
    return target.closest("[data-within]") ? "" : ", beyond the limits";
  };
  // What the pointer is over, what the server was last asked about, and its last words. There is one
  // request under way at most; the newest place is asked about once that is answered.
  let pointer = null,
    found = null,
    asked = null,
    words = null;
  const find = () => {
    const target = document.elementFromPoint(pointer.clientX, pointer.clientY),
      map = mapAt(target),
      facts = map && JSON.parse(map.dataset.map),
      position = map && positionAt(map, facts, pointer);
    if (!position) return null;
    const value = JSON.stringify(position);
    // The same position on another map is asked about again.
    return {
      map,
      name: facts.name,
      value,
      key: value + map.dataset.map,
      place: placeOf(facts, target),
    };
  };
  const show = () => window.explorer.tell(found?.map, words);
  const ask = () => {
    asked = found;
    window.explorer.press(`${asked.name}.read`, asked.value);
  };
  const update = () => {
    const before = found;
    found = find();
    if (before?.name !== found?.name) {
      window.explorer.tell(before?.map);
      asked = words = null;
    }
    if (found && found.key !== before?.key && !asked) ask();
    show();
  };
  const follow = ({ clientX, clientY }) => {
    pointer = { clientX, clientY };
    update();
  };
  addEventListener("pointermove", follow);
  addEventListener("pointerdown", follow);
  const kinds = { childList: true, attributeFilter: ["data-map"] };
  window.explorer.watch(() => found && update(), kinds);
  addEventListener("click", ({ target }) => {
    // A click tells whole pixels, other than the pointer that read the map.
    if (found && mapAt(target)) window.explorer.press(`${found.name}.go`, found.value);
  });
  return (value, text) => {
    // The pointer may have left the map, and come back, meanwhile.
    if (asked?.value !== value) return;
    words = text + asked.place;
    show();
    if (asked.key === found.key) asked = null;
    else ask();
  };
})();
