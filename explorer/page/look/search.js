// The search: sends what is typed into it, shows what the server finds, and goes from one to another
// by the arrows. Enter presses the present one.
window.explorer.search ??= (() => {
  const { capture } = window.explorer;
  const FIELD = "input.ex-search",
    HERE = "is-here";
  const buttons = () => [...document.querySelectorAll(".ex-results > button")];
  const show = (button) => {
    for (const each of buttons()) each.classList.toggle(HERE, each === button);
    button?.scrollIntoView({ block: "nearest" });
  };
  const ask = ({ value }) => window.explorer.press("search.ask", value);
  const STEPS = { ArrowDown: 1, ArrowUp: -1, Enter: 0 };
  capture("keydown", (event) => {
    const { key, target, ctrlKey, metaKey, shiftKey } = event;
    const letter = (ctrlKey || metaKey) && key.toLowerCase();
    if (letter === "k" || (letter === "p" && shiftKey)) {
      window.explorer.open("Search");
      const field = document.querySelector(FIELD);
      field?.select();
      if (field) ask(field);
    } else if (target.matches?.(FIELD) && key in STEPS) {
      const all = buttons(),
        at = all.findIndex((each) => each.classList.contains(HERE));
      if (STEPS[key]) show(all[(at + STEPS[key] + all.length) % all.length]);
      else all[at]?.click();
    } else {
      if (key === "Escape") clear();
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  });
  // What was found is gone once it is pressed or left.
  const clear = () => document.querySelector(".ex-results")?.replaceChildren();
  addEventListener("click", ({ target }) => {
    if (target.closest?.(".ex-results, .ex-shade")) clear();
  });
  addEventListener("input", ({ target }) => {
    if (target.matches(FIELD)) ask(target);
  });
  // What the server has found for a text; another one may have been typed since.
  return (text, html) => {
    if (document.querySelector(FIELD)?.value !== text) return;
    document.querySelector(".ex-results").innerHTML = html;
    show(buttons()[0]);
  };
})();
