"""How a browser tells of presses: a script of ours writes them to a number of its own tab.

viser tells of values alone. The script sends what any number field would send, past the same
guard and in the same order as the values of other controls, so that a value is known to come
from the press during which it arrives.
"""

from __future__ import annotations

import viser

from explorer.app.browser.viser_gaps import element_id, run_script_in
from explorer.app.state.presses import Presses

INBOX = "INBOX"


def listen(client: viser.ClientHandle, presses: Presses) -> None:
    """Take note of the presses of a browser that has come."""
    inbox = client.gui.add_number("Press", 0, visible=False)

    # On the thread that reads the browser's messages, one after the other.
    @inbox.on_update
    async def _(event: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
        presses.tell(client.client_id, event.target.value, event.target.update_timestamp)

    run_script_in(client, SCRIPT.replace(INBOX, element_id(inbox)))


SCRIPT = """
(() => {
  const inbox = "INBOX";
  // After a lost connection the tab is another one to the server.
  if (window.explorerPresses) {
    window.explorerPresses.inbox = inbox;
    return;
  }
  const presses = (window.explorerPresses = { inbox });
  // Whether the pointer is held, and whether the explorer was told so.
  let number = 0, isHeld = false, isTold = false;
  const tell = (value) => {
    const send = window.__viserMutable?.sendMessage;
    if (send) send({ type: "GuiUpdateMessage", uuid: presses.inbox, updates: { value } });
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
  addEventListener("pointerdown", (event) => {
    if (!event.isPrimary || event.button !== 0) return;
    // The release of the one before may have been lost.
    release();
    number += 1;
    isHeld = true;
    goOn();
  }, true);
  addEventListener("pointermove", (event) => {
    if (!event.isPrimary || !isHeld) return;
    if (event.buttons & 1) goOn();
    else release();
  }, true);
  addEventListener("pointerup", (event) => {
    if (event.isPrimary && event.button === 0) release();
  }, true);
  // What a finger moves may go on after the browser has stopped to call it a pointer.
  addEventListener("pointercancel", (event) => {
    if (event.isPrimary && event.pointerType !== "touch") release();
  }, true);
  for (const name of ["touchend", "touchcancel"]) {
    addEventListener(name, ({ touches }) => {
      if (!touches.length) release();
    }, true);
  }
  // A release in another window is not heard of; a pointer that is still held says so later.
  addEventListener("blur", pause);
  addEventListener("pagehide", pause);
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) pause();
  });
})();
"""
"""Tells of presses in a browser, once its number is put in place of the inbox."""
