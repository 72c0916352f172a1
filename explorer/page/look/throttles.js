// Sends what controls still hold back before the next press or key is handled. The controls of a
// panel share a throttle of viser that keeps the newest message only, so that the last value of a
// control would be lost if another control is used within the throttle's time.
window.explorer.throttles ??= (() => {
  const { capture, clock } = window.explorer;
  // The throttle's time in milliseconds, by which its timer is known.
  const PAUSE = 50;
  const EVENTS = ["pointerdown", "pointerup", "click", "keydown", "input", "focusout"];
  // What each throttle does when its time is over, by the timer that it waits for.
  const waiting = new Map();
  const startTimer = window.setTimeout.bind(window);
  let send = null,
    hasSent = false;
  // A throttle starts its timer right after it has sent a message; the camera's is shorter. It may
  // be stopped by the number that it gets here, but then has nothing left to send anyway.
  window.setTimeout = (run, ...rest) => {
    const [pause] = rest;
    if (!hasSent || !(pause <= PAUSE)) return startTimer(run, ...rest);
    hasSent = false;
    if (pause < PAUSE) return clock.after(pause, run);
    const end = () => {
      waiting.delete(timer);
      run();
    };
    const timer = clock.after(pause, end);
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
      clock.atFrame(watch);
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
      clock.cancel(timer);
      end();
    }
  };
  for (const name of EVENTS) capture(name, flush);
  watch();
  return true;
})();
