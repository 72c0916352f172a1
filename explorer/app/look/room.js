// Makes the scene fill the room beside the panels, and keeps panels that grow within the window.
window.explorer.room ??= (() => {
  // Milliseconds to wait; panels take less to glide to their places.
  const REST = 300;
  const ROOT = "[data-dock-root]",
    PANEL = "[data-floating-window]";
  const isOff = (a, b) => Math.abs(a - b) > 1;
  const fitScene = () => {
    const page = window.__viserMutable,
      canvas = page?.canvas;
    if (!canvas?.parentElement) return;
    const { clientWidth: width, clientHeight: height } = canvas.parentElement;
    if (isOff(canvas.clientWidth, width) || isOff(canvas.clientHeight, height)) {
      page.syncCanvasSize?.(width, height);
    }
  };
  // A user may have left a panel over the edge: only a panel that has grown is moved back.
  const heights = new WeakMap();
  const fitPanels = () => {
    const root = document.querySelector(ROOT);
    if (!root) return;
    const edge = root.getBoundingClientRect().bottom;
    let isOut = false;
    for (const panel of document.querySelectorAll(PANEL)) {
      const { bottom, height } = panel.getBoundingClientRect();
      if (height > (heights.get(panel) ?? 0) + 1 && bottom > edge + 1) isOut = true;
      heights.set(panel, height);
    }
    if (!isOut) return;
    // The page moves its panels into a root that shrinks.
    root.style.height = "calc(100% - 1px)";
    requestAnimationFrame(() =>
      requestAnimationFrame(() => {
        root.style.height = "100%";
      }),
    );
  };
  let rest;
  const look = () => {
    clearTimeout(rest);
    rest = setTimeout(() => {
      fitScene();
      fitPanels();
    }, REST);
  };
  const sizes = new ResizeObserver(look),
    watched = new WeakSet();
  const watch = () => {
    const scene = window.__viserMutable?.canvas;
    for (const each of [scene, scene?.parentElement, ...document.querySelectorAll(PANEL)]) {
      if (!each || watched.has(each)) continue;
      watched.add(each);
      sizes.observe(each);
    }
  };
  new MutationObserver(watch).observe(document.body, { childList: true, subtree: true });
  watch();
  return true;
})();
