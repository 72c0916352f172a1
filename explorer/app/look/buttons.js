// Sends presses on markup, [data-press=name] with an optional data-value, to the server's inbox.
window.explorer.buttons ??= (() => {
  let inbox = null;
  // The same press twice in a row is two messages.
  let count = 0;
  window.explorer.press = (name, value) => {
    count += 1;
    const text = JSON.stringify({ name, value, count });
    window.explorer.send(inbox, text);
  };
  const buttonAt = (target) => target.closest?.("[data-press]") ?? null;
  const isSame = (one, other) =>
    one.dataset.press === other.dataset.press && one.dataset.value === other.dataset.value;
  addEventListener("click", ({ target }) => {
    const button = buttonAt(target);
    if (button) window.explorer.press(button.dataset.press, button.dataset.value ?? "");
  });
  // Markup is replaced when its numbers change: a press that began on the old markup counts, and
  // the focus of the keyboard stays.
  let pressed = null;
  let focused = null;
  addEventListener(
    "pointerdown",
    ({ target }) => {
      pressed = buttonAt(target);
      focused = null;
    },
    true,
  );
  addEventListener(
    "pointerup",
    ({ target }) => {
      const button = buttonAt(target);
      if (button && pressed && !pressed.isConnected && isSame(button, pressed)) button.click();
      pressed = null;
    },
    true,
  );
  addEventListener("focusin", ({ target }) => {
    focused = buttonAt(target);
  });
  const keepFocus = () => {
    if (!focused || focused.isConnected || document.activeElement !== document.body) return;
    const buttons = [...document.querySelectorAll("[data-press]")];
    buttons.find((button) => isSame(button, focused))?.focus({ preventScroll: true });
  };
  new MutationObserver(keepFocus).observe(document.body, { childList: true, subtree: true });
  return (uuid) => {
    inbox = uuid;
  };
})();
