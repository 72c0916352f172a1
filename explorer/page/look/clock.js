// The clock of the page's scripts: what still waits for it is known, and a test may advance it, or
// slow it down while it does what a user does within a pause.
window.explorer.clock ??= (() => {
  const startTimer = window.setTimeout.bind(window),
    stopTimer = window.clearTimeout.bind(window);
  // What waits, by its number: when it is due, what it does, whether it returns for ever, so that the
  // page is at rest all the same, and the browser's timer for it. The numbers are negative, so that
  // none of them is that of a timer of the browser.
  const pending = new Map();
  let count = 0,
    frames = 0;
  // Milliseconds of this clock in one of the browser's, when that began, and by how much the clock
  // was ahead then.
  let pace = 1,
    pacedAt = 0,
    ahead = 0;
  const shift = () => ahead + (pace - 1) * (performance.now() - pacedAt);
  const now = () => performance.now() + shift();
  const end = (number) => {
    const { run } = pending.get(number);
    pending.delete(number);
    run();
  };
  const wait = (number) => {
    const each = pending.get(number);
    stopTimer(each.timer);
    each.timer = startTimer(end, Math.max(0, each.due - now()) / pace, number);
  };
  // Calls a function after a pause in milliseconds; returns the number to cancel it by.
  const after = (pause, run, returns = false) => {
    count -= 1;
    pending.set(count, { due: now() + pause, run, returns, timer: null });
    wait(count);
    return count;
  };
  const cancel = (number) => {
    stopTimer(pending.get(number)?.timer);
    pending.delete(number);
  };
  // Calls a function before the next frame.
  const atFrame = (run) => {
    frames += 1;
    requestAnimationFrame(() => {
      frames -= 1;
      run();
    });
  };
  // Ends the pauses that are over after some more milliseconds, in the order of their ends.
  const advance = (pause) => {
    const until = now() + pause;
    for (;;) {
      const due = [...pending].filter(([, each]) => each.due <= until);
      if (!due.length) break;
      const [number, each] = due.reduce((a, b) => (b[1].due < a[1].due ? b : a));
      ahead += Math.max(0, each.due - now());
      stopTimer(each.timer);
      end(number);
    }
    ahead += Math.max(0, until - now());
    for (const number of pending.keys()) wait(number);
  };
  const unreturning = () => [...pending.values()].filter(({ returns }) => !returns);
  // Ends the pause that would be over first, unless something waits for a frame.
  const hasten = () => {
    const awaited = unreturning();
    if (!frames && awaited.length) advance(Math.min(...awaited.map(({ due }) => due)) - now());
  };
  const setPace = (wanted) => {
    [ahead, pace, pacedAt] = [shift(), wanted, performance.now()];
    for (const number of pending.keys()) wait(number);
  };
  const isQuiet = () => !unreturning().length && !frames;
  return { after, cancel, atFrame, advance, hasten, setPace, isQuiet };
})();

// Returns a promise that the page has come to rest: all that the server sent before a mark has
// arrived and is laid out, and no pause is pending: those that are end at once. Some frames in a
// row must find it so, as what is drawn in one may ask for the next.
window.explorer.settled ??= (mark) =>
  new Promise((resolve) => {
    let still = 0;
    const look = () => {
      const { clock, mark: ofAll, ownMark } = window.explorer;
      const hasArrived =
        ofAll >= mark && ownMark >= mark && !window.__viserMutable?.messageQueue.length;
      if (hasArrived) clock.hasten();
      still = hasArrived && clock.isQuiet() ? still + 1 : 0;
      if (still > 2) resolve(true);
      else requestAnimationFrame(look);
    };
    look();
  });
