// Scrolls the manual to a heading or a term of a page once that page is drawn, and marks it. The
// manual has a button that closes it, which Escape presses too.
window.explorer.manual ??= (() => {
  const { clock } = window.explorer;
  // Milliseconds between two looks at what is drawn, and how many there are at most.
  const PAUSE = 50,
    MOST = 100;
  // Pixels above what is scrolled to.
  const GAP = 8;
  const CARD = "[data-floating-window][data-ex=card]",
    MARK = "ex-found";
  const addClose = (card) => {
    if (card.querySelector(".ex-closes")) return;
    const button = window.explorer.closeButton("Close the manual", "Close (Escape)");
    button.dataset.press = "help.close";
    card.append(button);
  };
  const find = (title, words) => {
    const lines = [...document.querySelectorAll(`${CARD} :is(h1, h2, h3, strong)`)];
    if (!lines.some((each) => each.localName === "h1" && each.textContent === title)) return null;
    return lines.find((each) => each.textContent === words);
  };
  return (title, words, looks = MOST) => {
    const found = find(title, words);
    if (!found) {
      if (looks) clock.after(PAUSE, () => window.explorer.manual(title, words, looks - 1));
      return;
    }
    addClose(found.closest(CARD));
    document.querySelector(`.${MARK}`)?.classList.remove(MARK);
    found.classList.add(MARK);
    // To scroll it into view would move the whole page besides.
    const pages = found.closest(".mantine-ScrollArea-viewport");
    pages.scrollTop += found.getBoundingClientRect().top - pages.getBoundingClientRect().top - GAP;
  };
})();
