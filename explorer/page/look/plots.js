// Sends what a pointer does to the plots of studies as presses of "studies.plot", and shows what the
// server reads there. Places are shares of the width and height of a plot, from its lower left corner.
window.explorer.plots ??= (() => {
  const { clock } = window.explorer;
  // Pixels beyond which a press is a drag; milliseconds in which a click may become a double one.
  const DRAG_PIXELS = 4,
    DOUBLE_CLICK = 300;
  const plotAt = (target) => target?.closest?.("[data-plot]") ?? null;
  const within = (share) => Math.min(1, Math.max(0, share));
  const placeIn = (plot, { clientX, clientY }) => {
    const { left, bottom, width, height } = plot.getBoundingClientRect();
    return [within((clientX - left) / width), within((bottom - clientY) / height)];
  };
  const send = (plot, act, end, start = end) => {
    const { width, height } = plot.getBoundingClientRect();
    const event = { ...JSON.parse(plot.dataset.plot), act, start, end, size: [width, height] };
    window.explorer.press("studies.plot", JSON.stringify(event));
  };
  const show = (plot, words, path) => {
    // Another drawing may have taken its place.
    if (!plot.isConnected) return;
    window.explorer.tell(plot.closest(".ex-plot"), words || null);
    plot.querySelector(".near").setAttribute("d", path);
  };
  // The press that has not ended; the plot under the pointer with the place there; the plot and the
  // place whose reading the server has not answered yet; the pick that waits for a second click.
  let pressed = null,
    pointer = null,
    asked = null,
    picking = null;
  const ask = () => {
    asked = pointer;
    send(pointer.plot, "read", pointer.place);
  };
  const draw = ({ plot, start }, end) => {
    const box = plot.querySelector(".drag"),
      [left, right] = [start[0], end[0]].toSorted((a, b) => a - b),
      [low, high] = [start[1], end[1]].toSorted((a, b) => a - b),
      sides = { x: left, y: 1 - high, width: right - left, height: high - low };
    for (const [name, share] of Object.entries(sides)) {
      box.setAttribute(name, share * plot.viewBox.baseVal.width);
    }
  };
  addEventListener("pointermove", (event) => {
    if (pressed) {
      if (isDrag(event)) draw(pressed, placeIn(pressed.plot, event));
      return;
    }
    const plot = plotAt(event.target);
    if (pointer && pointer.plot !== plot) {
      show(pointer.plot, "", "");
      pointer = asked = null;
    }
    if (!plot) return;
    pointer = { plot, place: placeIn(plot, event), facts: plot.dataset.plot };
    // The server does not answer for a study that has been closed meanwhile.
    if (asked?.facts !== pointer.facts) ask();
  });
  const isDrag = ({ clientX, clientY }) =>
    Math.hypot(clientX - pressed.x, clientY - pressed.y) > DRAG_PIXELS;
  addEventListener("pointerdown", (event) => {
    const plot = plotAt(event.target);
    if (!plot || event.button !== 0) return;
    pressed = { plot, start: placeIn(plot, event), x: event.clientX, y: event.clientY };
  });
  addEventListener("pointerup", (event) => {
    if (!pressed) return;
    const { plot, start } = pressed,
      end = placeIn(plot, event);
    clock.cancel(picking);
    if (isDrag(event)) send(plot, "brush", end, start);
    else picking = clock.after(DOUBLE_CLICK, () => send(plot, "pick", end));
    draw(pressed, start);
    pressed = null;
  });
  addEventListener("pointercancel", () => {
    if (pressed) draw(pressed, pressed.start);
    pressed = null;
  });
  addEventListener("dblclick", (event) => {
    const plot = plotAt(event.target);
    if (!plot) return;
    clock.cancel(picking);
    send(plot, "free", placeIn(plot, event));
  });
  return (name, words, path) => {
    if (!asked || JSON.parse(asked.plot.dataset.plot).plot !== name) return;
    show(asked.plot, words, path);
    // The pointer may have moved on since it was asked.
    const isElsewhere = asked !== pointer;
    asked = null;
    if (isElsewhere) ask();
  };
})();
