// Closes the card on top at Escape or a click beside it; opens the palette at a press on
// [data-opens=commands].
window.explorer.cards ??= (() => {
  const CARD = ".mantine-Modal-content",
    AROUND = ".mantine-Modal-inner, .mantine-Modal-overlay";
  const isBeside = (it) => !!it.closest?.(AROUND) && !it.closest(CARD);
  const close = () => {
    const card = [...document.querySelectorAll(`${CARD} [data-closed-by]`)].at(-1);
    if (card) document.getElementById(card.getAttribute("data-closed-by"))?.click();
  };
  addEventListener(
    "keydown",
    (event) => {
      // The palette may lie over a card, and is closed first.
      if (event.key === "Escape" && !event.target.closest?.(".mantine-Spotlight-content")) close();
    },
    true,
  );
  // A pointer that is pressed on a card and released beside it, as to select text, closes nothing.
  let isPressedBeside = false;
  addEventListener(
    "pointerdown",
    ({ target }) => {
      isPressedBeside = isBeside(target);
    },
    true,
  );
  addEventListener(
    "click",
    ({ target }) => {
      if (isPressedBeside && isBeside(target)) close();
    },
    true,
  );
  // viser opens its palette at this key, which nothing on the server can press.
  const PALETTE_KEY = { key: "k", code: "KeyK", ctrlKey: true, bubbles: true };
  addEventListener("click", ({ target }) => {
    if (!target.closest?.("[data-opens=commands]")) return;
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", PALETTE_KEY));
  });
  return true;
})();
