"""What of the page keeps to the room that it has, where viser's page loses sight of that.

While its panels are laid out, viser's page may give the scene the size that it had before them, and
leaves it so: it then reaches under the panels. And a floating panel that grows downwards, once
somebody has moved it, grows out of the window. With this script in the page both follow.
"""

SCRIPT = """
(() => {
  if (window.explorerRoom) return;
  window.explorerRoom = true;
  // Longer than panels take to glide to their places, in milliseconds.
  const REST = 300;
  const ROOT = "[data-dock-root]", PANEL = "[data-floating-window]";
  const isOff = (a, b) => Math.abs(a - b) > 1;
  const fitScene = () => {
    const page = window.__viserMutable, canvas = page?.canvas;
    if (!canvas?.parentElement) return;
    const { clientWidth: width, clientHeight: height } = canvas.parentElement;
    if (isOff(canvas.clientWidth, width) || isOff(canvas.clientHeight, height)) {
      page.syncCanvasSize?.(width, height);
    }
  };
  // A hand may have left a panel over the edge: only one that has grown is drawn back.
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
    // The page draws its panels back into a root that shrinks.
    root.style.height = "calc(100% - 1px)";
    requestAnimationFrame(() => requestAnimationFrame(() => { root.style.height = "100%"; }));
  };
  let rest;
  const look = () => {
    clearTimeout(rest);
    rest = setTimeout(() => {
      fitScene();
      fitPanels();
    }, REST);
  };
  const sizes = new ResizeObserver(look), watched = new WeakSet();
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
})();
"""
"""Keeps the scene beside the panels, and panels that grow within the window."""
