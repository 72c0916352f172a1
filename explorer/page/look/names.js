// Says to screen readers what the page shows by its layout: the words beside a control as its name,
// its value with the unit, groups of controls, and the parts of the page. Gives the browser's tab the
// names of design and product, and puts hints beside the panel, where they cover no control.
window.explorer.names ??= (() => {
  const { all, capture, clock, watch } = window.explorer;
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
  // The unit of a control: that in brackets beside it, or else the first one in the title of its
  // folder; "" for a plain number.
  const FOLDER = ".mantine-Paper-root:has(> .mantine-Paper-root:first-child)";
  const unitOf = (control) => {
    const title = control.closest(FOLDER)?.firstElementChild.textContent ?? "";
    const [own, ofAll] = [labelOf(control), title].map(
      (words) => /\((?:± )?([^(),]+)[^()]*\)$/.exec(words.trim())?.[1] ?? "",
    );
    return (own || ofAll).normalize("NFKC");
  };
  const tellValue = (slider) => {
    const words = `${slider.ariaValueNow} ${unitOf(slider).replace("°", "degrees")}`.trim();
    if (slider.ariaValueText !== words) slider.ariaValueText = words;
  };
  // So many rows after the markup of a group belong to it.
  const nameGroup = (group) => {
    let row = group;
    while (!row.nextElementSibling) row = row.parentElement;
    const ids = Array.from({ length: group.dataset.owns }, (_, index) => {
      row = row.nextElementSibling;
      return (row.id ||= `${group.ariaLabel} ${index}`.replace(/\W+/g, "-"));
    });
    group.setAttribute("aria-owns", ids.join(" "));
  };
  // Parts of the page by their selectors; without a name of its own a part has those of its tabs.
  const PARTS_OF_PAGE = [
    ["[data-dock-root] > :first-child", "main", "Scene"],
    ["[data-dock-region], [data-ex=drawer], [data-ex=card]", "region"],
    [
      "canvas[data-engine]",
      "img",
      "The mechanism. Arrow keys turn it, W, A, S, D, Q and E move it.",
    ],
  ];
  const namePart = (part, role, words) => {
    const tabs = [...part.querySelectorAll("[role=tab]")].map((tab) => tab.title);
    if (part.role !== role) part.role = role;
    name(part, words ?? tabs.join(", "));
  };
  const nameControl = (control) => {
    const words = labelOf(control);
    if (!words) return;
    const row = rowOf(control);
    const fields = [...row.querySelectorAll("input[inputmode=decimal]")];
    const part = PARTS[fields.length]?.[fields.indexOf(control)];
    if (control.role === "slider") tellValue(control);
    name(control, part ? `${words.replace(/ ends$/, "")} ${part}` : words);
  };
  const nameButton = (button) => {
    if (button.matches(".mantine-Notification-closeButton")) name(button, "Close");
    for (const [icon, words] of Object.entries(ICONS)) {
      if (button.querySelector(`.tabler-icon-${icon}`)) name(button, words);
    }
  };
  const nameTab = () => {
    const names = ["[data-document]", ".ex-product > h1"].map((each) =>
      document.querySelector(each),
    );
    if (names[0]) document.title = names.map((each) => each.textContent).join(" – ");
  };
  let isDue = false;
  const nameAll = () => {
    isDue = false;
    nameTab();
    window.explorer.stops?.();
    all(CONTROLS).forEach(nameControl);
    all("button").forEach(nameButton);
    all("[data-owns]").forEach(nameGroup);
    for (const [selector, ...words] of PARTS_OF_PAGE) {
      all(selector).forEach((part) => namePart(part, ...words));
    }
    // A list of tabs has tabs alone; each of them opens the panel as this button does.
    for (const button of all("[data-dock-bar] [data-dock-minimize]")) {
      Object.assign(button, { ariaHidden: "true", tabIndex: -1 });
    }
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
  const nameSoon = () => {
    if (!isDue) clock.after(100, nameAll);
    isDue = true;
    all(".mantine-Tooltip-tooltip:not([data-beside])").forEach(placeHint);
  };
  watch(nameSoon, { childList: true, characterData: true });
  const tellValues = (changes) => changes.forEach(({ target }) => tellValue(target));
  watch(tellValues, { attributeFilter: ["aria-valuenow"] });
  nameAll();
  // What has the focus, or else the pointer, is marked in the sketch of the design variables.
  let pointed = null;
  const mark = () => {
    const words = labelOf(document.activeElement) || labelOf(pointed);
    for (const each of all("[data-variable]")) {
      each.classList.toggle("is-here", each.dataset.variable === words);
    }
  };
  capture("pointerover", ({ target }) => {
    pointed = target;
    mark();
  });
  for (const event of ["focusin", "focusout"]) capture(event, mark);
  return { rowOf, unitOf };
})();
