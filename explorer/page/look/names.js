// Gives each control the words beside it as its name for screen readers, the browser's tab the names
// of design and product, and puts hints beside the panel, where they cover no control.
window.explorer.names ??= (() => {
  const { capture } = window.explorer;
  const CONTROLS =
    "[role=slider], input:not([type=hidden]):not([type=file]):not([type=checkbox]), textarea";
  // Names of buttons by their icon.
  const ICONS = {
    "list-search": "Commands",
    adjustments: "Settings of the page",
    "arrow-back": "Back to the controls",
    maximize: "Expand plot",
  };
  // Names of fields side by side, by their number.
  const PARTS = { 2: ["least", "most"], 3: ["x", "y", "z"] };
  const name = (it, words) => {
    if (words && it.getAttribute("aria-label") !== words) it.setAttribute("aria-label", words);
  };
  // The smallest part of the page that holds a control and the words beside it.
  const rowOf = (control) => {
    for (let row = control?.parentElement; row; row = row.parentElement) {
      if (row.querySelector("label[for]")) return row;
    }
    return null;
  };
  const wordsOf = (label) => label.textContent.replace(/\s+/g, " ").trim();
  // The words beside a control; none if several labels are beside it, of other controls.
  const labelOf = (control) => {
    const labels = rowOf(control)?.querySelectorAll("label[for]") ?? [];
    return labels.length === 1 ? wordsOf(labels[0]) : "";
  };
  const nameControl = (control) => {
    const words = labelOf(control);
    if (!words) return;
    const row = rowOf(control);
    const fields = [...row.querySelectorAll("input[inputmode=decimal]")];
    const part = PARTS[fields.length]?.[fields.indexOf(control)];
    name(control, part ? `${words.replace(/ ends$/, "")} ${part}` : words);
  };
  const nameButton = (button) => {
    if (button.matches(".mantine-Notification-closeButton")) name(button, "Close");
    for (const [icon, words] of Object.entries(ICONS)) {
      if (button.querySelector(`.tabler-icon-${icon}`)) name(button, words);
    }
  };
  const nameTab = () => {
    const names = ["[data-document]", ".ex-product > b"].map((each) =>
      document.querySelector(each),
    );
    if (names[0]) document.title = names.map((each) => each.textContent).join(" – ");
  };
  let isDue = false;
  const nameAll = () => {
    isDue = false;
    nameTab();
    window.explorer.stops?.();
    document.querySelectorAll(CONTROLS).forEach(nameControl);
    document.querySelectorAll("button").forEach(nameButton);
  };
  // Width of the widest panel at a side of the window, and room beside a hint, in pixels.
  const WIDEST = 420,
    ROOM = 24;
  const placeHint = (hint) => {
    const row = rowOf(document.querySelector(`[aria-describedby="${hint.id}"]`));
    if (!row) return;
    const at = row.getBoundingClientRect(),
      { width, height } = hint.getBoundingClientRect();
    const left = at.x > innerWidth / 2 ? at.left - ROOM - width : at.right + ROOM;
    if (at.width > WIDEST || left < 0 || left + width > innerWidth) return;
    const top = Math.min(Math.max(0, at.y + (at.height - height) / 2), innerHeight - height);
    hint.dataset.beside = "";
    hint.style.setProperty("--left", `${left}px`);
    hint.style.setProperty("--top", `${top}px`);
  };
  const placeHints = () => {
    document.querySelectorAll(".mantine-Tooltip-tooltip:not([data-beside])").forEach(placeHint);
  };
  const nameSoon = () => {
    if (!isDue) window.explorer.clock.after(100, nameAll);
    isDue = true;
    placeHints();
  };
  const changes = { childList: true, characterData: true, subtree: true };
  new MutationObserver(nameSoon).observe(document.body, changes);
  nameAll();
  // What has the focus, or else the pointer, is named on the root: the stylesheet may point at it.
  let pointed = null;
  const mark = () => {
    const words = [document.activeElement, pointed].map(labelOf);
    document.documentElement.dataset.at = words.find((each) => each) ?? "";
  };
  const pointAt = ({ target }) => {
    pointed = target;
    mark();
  };
  capture("pointerover", pointAt);
  for (const event of ["focusin", "focusout"]) capture(event, mark);
  return { labelOf, rowOf };
})();
