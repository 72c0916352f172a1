// Reports when the pointer is held and released, to the number of this tab on the server. A
// control sends its last value up to 50 ms after the frame that follows its release, which is
// reported after that.
window.explorer.holds ??= (() => {
  const { capture, clock } = window.explorer;
  // Time from that frame to the report.
  const LATE_MILLISECONDS = 100;
  // Id of the number field of this tab, which a new connection replaces.
  let inbox = null;
  // Number of the press, whether the pointer is held, whether the server knows so, and how often
  // there was something to report.
  let number = 0,
    isHeld = false,
    isReported = false,
    changes = 0;
  const report = (value) => window.explorer.send(inbox, value);
  const goOn = () => {
    changes += 1;
    if (!isReported) report(number);
    isReported = true;
  };
  const end = () => {
    changes += 1;
    if (isReported) report(-number);
    isReported = false;
  };
  const pause = () => {
    const before = changes;
    const endIfStill = () => changes === before && end();
    clock.atFrame(() => clock.after(LATE_MILLISECONDS, endIfStill));
  };
  const release = () => {
    isHeld = false;
    pause();
  };
  capture("pointerdown", (event) => {
    if (!event.isPrimary || event.button !== 0) return;
    // The release of the previous press may have been lost.
    end();
    number += 1;
    isHeld = true;
    goOn();
  });
  capture("pointermove", (event) => {
    if (!event.isPrimary || !isHeld) return;
    if (event.buttons & 1) goOn();
    else release();
  });
  capture("pointerup", (event) => event.isPrimary && event.button === 0 && release());
  // What a key does belongs to no press that is over.
  capture("keydown", () => isHeld || end());
  // A touch may go on after the browser has cancelled its pointer.
  capture("pointercancel", (event) => {
    if (event.isPrimary && event.pointerType !== "touch") release();
  });
  for (const name of ["touchend", "touchcancel"]) {
    capture(name, ({ touches }) => touches.length || release());
  }
  // A release in another window is never reported; a pointer that is still held moves again later.
  addEventListener("blur", pause);
  addEventListener("pagehide", end);
  document.addEventListener("visibilitychange", () => {
    // A hidden page draws no frames.
    if (document.hidden) end();
  });
  return (uuid) => {
    inbox = uuid;
  };
})();
