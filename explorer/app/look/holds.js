window.explorer ??= {};

// Reports when the pointer is held and released, to the number of this tab on the server.
window.explorer.holds ??= (() => {
  // Id of the text control of this tab, which a new connection replaces.
  let inbox = null;
  // Whether the pointer is held, and whether the explorer was told so.
  let number = 0,
    isHeld = false,
    isTold = false;
  const tell = (value) => {
    const message = { type: "GuiUpdateMessage", uuid: inbox, updates: { value } };
    window.__viserMutable?.sendMessage?.(message);
  };
  const goOn = () => {
    if (!isTold) tell(number);
    isTold = true;
  };
  const pause = () => {
    if (isTold) tell(-number);
    isTold = false;
  };
  const release = () => {
    isHeld = false;
    pause();
  };
  addEventListener(
    "pointerdown",
    (event) => {
      if (!event.isPrimary || event.button !== 0) return;
      // The release of the previous press may have been lost.
      release();
      number += 1;
      isHeld = true;
      goOn();
    },
    true,
  );
  addEventListener(
    "pointermove",
    (event) => {
      if (!event.isPrimary || !isHeld) return;
      if (event.buttons & 1) goOn();
      else release();
    },
    true,
  );
  addEventListener(
    "pointerup",
    (event) => {
      if (event.isPrimary && event.button === 0) release();
    },
    true,
  );
  // A touch may go on after the browser has cancelled its pointer.
  addEventListener(
    "pointercancel",
    (event) => {
      if (event.isPrimary && event.pointerType !== "touch") release();
    },
    true,
  );
  for (const name of ["touchend", "touchcancel"]) {
    addEventListener(
      name,
      ({ touches }) => {
        if (!touches.length) release();
      },
      true,
    );
  }
  // A release in another window is never reported; a pointer that is still held moves again later.
  addEventListener("blur", pause);
  addEventListener("pagehide", pause);
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) pause();
  });
  return (uuid) => {
    inbox = uuid;
  };
})();
