// Applies messages between two frames. viser applies them within one: there a node gets its new
// place at once, but a new shape, and new places of copies, only in the next frame, so that the
// platform would run ahead of its legs.
window.explorer.frames ??= (() => {
  const viser = window.__viserMutable;
  const requestFrame = viser.requestRender;
  let isApplying = false;
  // The page asks for a frame whenever messages have arrived.
  viser.requestRender = () => {
    requestFrame();
    if (isApplying || viser.messageQueue.length === 0) return;
    isApplying = true;
    try {
      viser.drainMessageQueue?.();
    } finally {
      isApplying = false;
    }
  };
  return true;
})();
