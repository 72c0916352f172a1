// Opens what [data-opens=title] names: a tab of a panel, or a dialog.
// Closes the dialog at Escape, at a click beside it, and at its button.
window.explorer.opens ??= (() => {
  const { all, capture, make } = window.explorer;
  const DIALOG = "[data-floating-window][data-ex=dialog]",
    OPEN = `${DIALOG}[data-ex-open]`,
    CARD_CLOSE = "[data-ex=card] > .ex-closes";
  const ENTER = { key: "Enter", code: "Enter", bubbles: true };
  const shade = make("div", { className: "ex-shade" });
  const closeDialogs = () => {
    for (const each of all(OPEN)) {
      const opener = document.querySelector(`[data-opens="${each.ariaLabel}"]`);
      if (each.contains(document.activeElement)) opener?.focus({ preventScroll: true });
      delete each.dataset.exOpen;
    }
    shade.remove();
  };
  window.explorer.closeButton = (ariaLabel, title) =>
    make("button", { type: "button", className: "ex-closes", textContent: "×", title, ariaLabel });
  const openDialog = (dialog, title) => {
    const wasOpen = dialog.dataset.exOpen !== undefined;
    closeDialogs();
    if (wasOpen) return;
    dialog.dataset.exOpen = "";
    Object.assign(dialog, { role: "dialog", ariaLabel: title });
    dialog.parentElement.append(shade);
    if (!dialog.querySelector(".ex-closes")) {
      const button = window.explorer.closeButton("Close the dialog", "Close");
      button.addEventListener("click", closeDialogs);
      dialog.append(button);
    }
    dialog.querySelector("[type=search], .ex-closes").focus({ preventScroll: true });
  };
  const open = (title) => {
    const tab = all("[data-dock-tab]").find((each) => each.title === title);
    if (!tab) {
      // On a phone viser lists all panels, one below another.
      document.querySelector(`[role=button][aria-label$=" panel ${title}"]`)?.click();
      return;
    }
    const dialog = tab.closest(DIALOG);
    if (dialog) openDialog(dialog, title);
    else {
      closeDialogs();
      tab.dispatchEvent(new KeyboardEvent("keydown", ENTER));
    }
  };
  addEventListener("click", ({ target }) => {
    const { opens, value } = target.closest?.("[data-opens]")?.dataset ?? {};
    if (opens) open(opens);
    // A text that was found names the folders that it stands in.
    if (opens && value) window.explorer.unfold(value.split("\n"));
  });
  // What a dialog was opened for is done: it leaves the view of the result.
  addEventListener("click", ({ target }) => {
    if (target.closest?.("[data-closes] [data-press]")) closeDialogs();
  });
  capture("keydown", ({ key, target }) => {
    // A list in a dialog lies over it, and is closed first.
    const isOver = target.closest?.("[aria-haspopup][aria-expanded=true]");
    if (key !== "Escape" || isOver) return;
    if (document.querySelector(OPEN)) closeDialogs();
    // In a field it discards what is typed.
    else if (target.localName !== "input") document.querySelector(CARD_CLOSE)?.click();
  });
  // A pointer pressed in a dialog and released beside it, as to select text, closes nothing.
  shade.addEventListener("click", closeDialogs);
  window.explorer.open = open;
  return true;
})();
