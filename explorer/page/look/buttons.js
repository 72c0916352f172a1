// Sends presses on markup, [data-press=name] with an optional data-value, to the server's inbox.
// What the pointer or the focus of the keyboard rests on, [data-hover=name], is sent as a press of
// that name with the same value, and without a value once it is left.
window.explorer.buttons ??= (() => {
  const { all, capture, watch } = window.explorer;
  let inbox = null;
  // Two equal presses in a row must be different messages, even if they come from two pages or
  // from one page before and after it was loaded again.
  let count = Math.floor(Math.random() * 2 ** 52);
  window.explorer.press = (name, value) => {
    count += 1;
    window.explorer.send(inbox, JSON.stringify({ name, value, count }));
  };
  addEventListener("click", ({ target }) => {
    const button = target.closest?.("[data-press]");
    if (button) window.explorer.press(button.dataset.press, button.dataset.value ?? "");
  });
  // Buttons that press, and those that open a tab or a dialog.
  const BUTTON = "[data-press], [data-opens]";
  const buttonAt = (target) => target.closest?.(BUTTON) ?? null;
  const isSame = (one, other) =>
    ["press", "value", "opens"].every((key) => one.dataset[key] === other.dataset[key]);
  // Markup is replaced when more than its numbers changes: a press that began on the old markup
  // counts, and the focus of the keyboard stays.
  let pressed = null;
  let focused = null;
  capture("pointerdown", ({ target }) => {
    pressed = buttonAt(target);
    focused = null;
  });
  capture("pointerup", ({ target }) => {
    const button = buttonAt(target);
    if (button && pressed && !pressed.isConnected && isSame(button, pressed)) button.click();
    pressed = null;
  });
  addEventListener("focusin", ({ target }) => {
    focused = buttonAt(target);
  });
  // Markup that is there until the next press, [data-until-press=name]: a press anywhere but in
  // the scene, which turns the camera, is sent as a press of that name.
  capture("pointerdown", ({ target }) => {
    if (target.localName === "canvas") return;
    for (const { dataset } of all("[data-until-press]")) {
      window.explorer.press(dataset.untilPress, "");
    }
  });
  // Milliseconds between two reports of what is rested on.
  const HOVER_PAUSE = 80;
  const isThere = ({ name, value }) =>
    all(`[data-hover="${name}"]`).some(({ dataset }) => dataset.value === value);
  // What the pointer and the keyboard rest on; what was moved last is reported. A change of layout
  // under a resting pointer fires pointerover too, which moves nothing.
  const rested = { pointer: null, keyboard: null };
  let moved = "pointer";
  let reported = null;
  let timer = null;
  const reportRested = () => {
    timer = null;
    const hovered = rested[moved] ?? rested.keyboard ?? rested.pointer;
    if (hovered?.name === reported?.name && hovered?.value === reported?.value) return;
    if (reported && reported.name !== hovered?.name) window.explorer.press(reported.name, "");
    if (hovered) window.explorer.press(hovered.name, hovered.value);
    reported = hovered;
  };
  const restOn = (device, element) => {
    rested[device] = element
      ? { name: element.dataset.hover, value: element.dataset.value ?? "" }
      : null;
    timer ??= window.explorer.clock.after(HOVER_PAUSE, reportRested);
  };
  const pointAt = (target) => restOn("pointer", target?.closest?.("[data-hover]"));
  addEventListener("pointerover", ({ target }) => pointAt(target));
  // The pointer has left the window, or a finger the screen.
  addEventListener("pointerout", ({ relatedTarget }) => relatedTarget || pointAt(null));
  for (const type of ["pointermove", "pointerdown"]) {
    capture(type, ({ target }) => {
      if (moved === "pointer") return;
      moved = "pointer";
      pointAt(target);
    });
  }
  addEventListener("focusin", ({ target }) => {
    if (!target.matches?.("[data-hover]:focus-visible")) return;
    moved = "keyboard";
    restOn("keyboard", target);
  });
  addEventListener("focusout", ({ target }) => {
    if (target.matches?.("[data-hover]")) restOn("keyboard", null);
  });
  const dropRested = () => {
    for (const device of ["pointer", "keyboard"]) {
      if (rested[device] && !isThere(rested[device])) restOn(device, null);
    }
  };
  const keepFocus = () => {
    if (!focused || focused.isConnected || document.activeElement !== document.body) return;
    const button = all(BUTTON).find((each) => isSame(each, focused));
    button?.focus({ preventScroll: true });
  };
  watch(() => {
    keepFocus();
    dropRested();
  });
  return (uuid) => {
    inbox = uuid;
  };
})();
