// Sends what controls still hold back before the next press or key is handled. The controls of a
// panel share a throttle of viser that keeps the newest message only, so that the last value of a
// control would be lost if another control is used within the throttle's time.
window.explorer.throttles ??= (() => {
  // The throttle's time in milliseconds, by which its timer is known.
  const PAUSE = 50;
  const EVENTS = ["pointerdown", "pointerup", "click", "keydown", "input", "focusout"];
  // What each throttle does when its time is over, by the timer that it waits for.
  const waiting = new Map();
  const startTimer = window.setTimeout.bind(window);
  let send = null,
    hasSent = false;
  // A throttle starts its timer right after it has sent a message.
  window.setTimeout = (run, ...rest) => {
    if (!hasSent || rest[0] !== PAUSE) return startTimer(run, ...rest);
    hasSent = false;
    const end = () => {
      waiting.delete(timer);
      run();
    };
    const timer = startTimer(end, ...rest);
    waiting.set(timer, end);
    return timer;
  };
  const sendThrottled = (message) => {
    send(message);
    hasSent = true;
    queueMicrotask(() => {
      hasSent = false;
    });
  };
  const watch = () => {
    const viser = window.__viserMutable;
    if (!viser) {
      requestAnimationFrame(watch);
      return;
    }
    // The page sets this anew with each connection.
    send = viser.sendMessage;
    Object.defineProperty(viser, "sendMessage", {
      get: () => send && sendThrottled,
      set: (value) => {
        send = value;
      },
    });
  };
  const flush = () => {
    // A throttle that still had something to send starts a new timer, which this loop ends too.
    for (const [timer, end] of waiting) {
      clearTimeout(timer);
      end();
    }
  };
  for (const name of EVENTS) addEventListener(name, flush, true);
  watch();
  return true;
})();
