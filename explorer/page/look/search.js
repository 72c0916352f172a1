// The search: sends what is typed into it, shows what the server finds, and goes from one to another
// by the arrows. Enter presses the present one, or the first one once it is there.
window.explorer.search ??= (() => {
  const { capture } = window.explorer;
  const HERE = "is-here";
  const fieldOf = () => document.querySelector("input.ex-search");
  const buttons = () => [...document.querySelectorAll(".ex-results > button")];
  const here = () => document.querySelector(`.ex-results > .${HERE}`);
  let isAsked = false,
    isEntered = false;
  const ask = (field) => {
    isAsked = true;
    isEntered = false;
    window.explorer.press("search.ask", field.value);
  };
  const show = (button) => {
    here()?.classList.remove(HERE);
    button?.classList.add(HERE);
    button?.scrollIntoView({ block: "nearest" });
  };
  const step = (by) => {
    const all = buttons();
    show(all[(all.indexOf(here()) + by + all.length) % all.length]);
  };
  const enter = () => {
    isEntered = isAsked;
    if (!isAsked) here()?.click();
  };
  const begin = () => {
    const field = fieldOf();
    field?.focus();
    field?.select();
    if (field) ask(field);
  };
  const open = () => {
    window.explorer.open("Search");
    // On a phone a panel unfolds.
    if (fieldOf()?.checkVisibility()) begin();
    else window.explorer.clock.after(300, begin);
  };
  const KEYS = { ArrowDown: () => step(1), ArrowUp: () => step(-1), Enter: enter };
  const clear = () => document.querySelector(".ex-results")?.replaceChildren();
  capture("keydown", (event) => {
    const { key, target, ctrlKey, metaKey, shiftKey } = event;
    const letter = (ctrlKey || metaKey) && key.toLowerCase();
    const isKey = letter === "k" || (letter === "p" && shiftKey);
    const run = isKey ? open : target === fieldOf() && KEYS[key];
    if (run) {
      run();
      event.preventDefault();
      event.stopPropagation();
    } else if (key === "Escape") clear();
  });
  // On a phone viser has a button of its own for its commands.
  capture("click", (event) => {
    const { target } = event;
    // What was found is gone once it is pressed or left.
    if (target.closest?.(".ex-results > button, .ex-shade")) window.explorer.clock.after(0, clear);
    if (!target.closest?.("button:has(> * > .tabler-icon-list-search)")) return;
    event.stopPropagation();
    open();
  });
  addEventListener("input", ({ target }) => target === fieldOf() && ask(target));
  // What the server has found for a text; another one may have been typed since.
  return (text, html) => {
    if (fieldOf()?.value !== text) return;
    isAsked = false;
    document.querySelector(".ex-results").innerHTML = html;
    show(buttons()[0]);
    if (isEntered) enter();
  };
})();
