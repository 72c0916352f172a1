// Gives each window of the page its place: the bar on top of the page, the drawer at the foot of the
// scene, dialogs over it, and cards, which users move. The scene fills the room beside them.
window.explorer.places ??= (() => {
  const { all, clock } = window.explorer;
  // Milliseconds to wait; panels take less to glide to their places.
  const REST = 300;
  const ROOT = "[data-dock-root]",
    WINDOW = "[data-floating-window]",
    TAB = "[data-dock-tab]";
  // Titles of the tabs in the drawer, and those of the dialogs.
  let titles = { drawer: [], dialogs: [] };
  const kindOf = (window_) => {
    if (window_.querySelector("[data-dock-unmergeable-header]")) return "bar";
    const names = [...window_.querySelectorAll(TAB)].map((tab) => tab.title);
    if (names.some((name) => titles.drawer.includes(name))) return "drawer";
    if (names.some((name) => titles.dialogs.includes(name))) return "dialog";
    return names.length ? "card" : null;
  };
  const markWindows = () => {
    for (const each of all(WINDOW)) {
      const kind = kindOf(each);
      if (kind && each.dataset.ex !== kind) each.dataset.ex = kind;
    }
  };
  const isOff = (a, b) => Math.abs(a - b) > 1;
  const setLength = (name, pixels) =>
    document.documentElement.style.setProperty(name, `${Math.round(pixels)}px`);
  // The drawer lies between the panels, and the scene ends above it.
  const fitDrawer = () => {
    const root = document.querySelector(ROOT)?.getBoundingClientRect();
    const scene = document.querySelector(`${ROOT} > :first-child`)?.getBoundingClientRect();
    if (!root || !scene) return;
    const drawer = document.querySelector(`${WINDOW}[data-ex=drawer]`);
    setLength("--ex-left", scene.left - root.left);
    setLength("--ex-right", root.right - scene.right);
    setLength("--ex-foot", drawer ? drawer.getBoundingClientRect().height : 0);
  };
  const fitScene = () => {
    const page = window.__viserMutable,
      canvas = page?.canvas;
    if (!canvas?.parentElement) return;
    const { clientWidth: width, clientHeight: height } = canvas.parentElement;
    if (isOff(canvas.clientWidth, width) || isOff(canvas.clientHeight, height)) {
      page.syncCanvasSize?.(width, height);
    }
  };
  // A user may have left a card over the edge: only a card that has grown is moved back.
  const heights = new WeakMap();
  const fitCards = () => {
    const root = document.querySelector(ROOT);
    if (!root) return;
    const edge = root.getBoundingClientRect().bottom;
    let isOut = false;
    for (const card of all(`${WINDOW}[data-ex=card]`)) {
      const { bottom, height } = card.getBoundingClientRect();
      if (height > (heights.get(card) ?? 0) + 1 && bottom > edge + 1) isOut = true;
      heights.set(card, height);
    }
    if (!isOut) return;
    // The page moves its windows into a root that shrinks.
    root.style.height = "calc(100% - 1px)";
    clock.atFrame(() =>
      clock.atFrame(() => {
        root.style.height = "100%";
      }),
    );
  };
  let rest;
  const look = () => {
    fitDrawer();
    clock.cancel(rest);
    rest = clock.after(REST, () => {
      fitDrawer();
      fitScene();
      fitCards();
    });
  };
  const sizes = new ResizeObserver(look),
    watched = new WeakSet();
  const watch = () => {
    markWindows();
    const scene = window.__viserMutable?.canvas;
    for (const each of [scene, scene?.parentElement, ...all(`${ROOT} > :first-child, ${WINDOW}`)]) {
      if (!each || watched.has(each)) continue;
      watched.add(each);
      sizes.observe(each);
    }
  };
  window.explorer.watch(watch);
  return (given) => {
    titles = given;
    // Marks the page that has a bar, for the stylesheet.
    document.documentElement.dataset.exPlaces = "";
    watch();
    look();
  };
})();
