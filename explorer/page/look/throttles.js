// Sends what controls still hold back before the next press or key is handled. The controls of a
// panel share a throttle of viser that keeps the newest message only, so that the last value of a
// control would be lost if another control is used within the throttle's time.
window.explorer.throttles ??= (() => {
  const { capture, clock } = window.explorer;
  // The times in milliseconds by which viser's throttles are known: those of the camera and of all else.
  const CAMERA = 20,
    PAUSE = 50;
  const EVENTS = ["pointerdown", "pointerup", "click", "keydown", "input", "focusout"];
  // What each throttle does when its time is over, by the timer that it waits for.
  const waiting = new Map();
  const [startTimer, stopTimer] = [window.setTimeout, window.clearTimeout].map((each) =>
    each.bind(window),
  );
  window.setTimeout = (run, pause, ...rest) => {
    if ((pause !== CAMERA && pause !== PAUSE) || rest.length)
      return startTimer(run, pause, ...rest);
    const end = () => {
      waiting.delete(timer);
      run();
    };
    const timer = clock.after(pause, end);
    if (pause === PAUSE) waiting.set(timer, end);
    return timer;
  };
  window.clearTimeout = (timer) => {
    waiting.delete(timer);
    clock.cancel(timer);
    stopTimer(timer);
  };
  const flush = () => {
    // A throttle that still had something to send starts a new timer, which this loop ends too.
    for (const [timer, end] of waiting) {
      clock.cancel(timer);
      end();
    }
  };
  for (const name of EVENTS) capture(name, flush);
  return true;
})();
