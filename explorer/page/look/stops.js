// Makes the page short for the keyboard: a toolbar and a list of tabs are one stop each, with arrow
// keys from button to button, and the head of a folder is a stop at which Enter and Space fold it.
// A folder that a user has opened or closed is so again in the next page of the browser.
window.explorer.stops ??= (() => {
  const { all, capture } = window.explorer;
  const TOOLBAR = "[role=toolbar]",
    HEAD = ".mantine-Paper-root > .mantine-Paper-root:first-child:has(> .tabler-icon)";
  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const itemsOf = (group) => [...group.querySelectorAll("button:enabled, [role=tab]")];
  const setStop = (items, stop) => {
    for (const each of items) each.tabIndex = each === stop ? 0 : -1;
  };
  // The stop of a group: the button with the focus, else the tab in front, else the last stop.
  const STOPS = [":focus", "[aria-selected=true]", "[tabindex='0']", "*"];
  const markGroup = (group) => {
    const items = itemsOf(group),
      find = (stop) => items.find((each) => each.matches(stop));
    setStop(items, find(STOPS.find(find)));
  };
  // Folders by the words of their heads, without the unit: whether they are open.
  const KEY = "explorer.folders";
  // A frame of another site, as in a notebook, has no storage.
  const storage = (() => {
    try {
      return localStorage;
    } catch {
      return null;
    }
  })();
  const folders = JSON.parse(storage?.getItem(KEY) ?? "{}");
  const nameOf = (head) => head.textContent.replace(/ \(.*/, "");
  const isOpen = (head) => head.querySelector(".tabler-icon-chevron-up") !== null;
  const known = new WeakSet();
  const markHead = (head) => {
    head.tabIndex = 0;
    head.setAttribute("role", "button");
    head.ariaExpanded = isOpen(head);
    Object.assign(head.parentElement, { role: "group", ariaLabel: head.textContent });
    if (known.has(head)) return;
    known.add(head);
    if ((folders[nameOf(head)] ?? isOpen(head)) !== isOpen(head)) head.click();
  };
  capture("click", ({ target }) => {
    const head = target.closest?.(HEAD);
    if (!head) return;
    folders[nameOf(head)] = !isOpen(head);
    storage?.setItem(KEY, JSON.stringify(folders));
  });
  // Opens the folders in sight with these heads, the outer one first.
  window.explorer.unfold = ([name, ...inner]) =>
    window.explorer.clock.after(100, () => {
      const isMeant = (head) =>
        head.textContent === name && !isOpen(head) && head.checkVisibility();
      // Those of a dialog come last.
      all(HEAD).findLast(isMeant)?.click();
      if (inner.length) window.explorer.unfold(inner);
    });
  // The nearest button in the direction of an arrow; one aside counts as farther.
  const neighbour = (items, from, [right, down]) => {
    const middleOf = (it) => {
      const { x, y, width, height } = it.getBoundingClientRect();
      return [x + width / 2, y + height / 2];
    };
    const [x0, y0] = middleOf(from);
    let best = null,
      least = Infinity;
    for (const each of items) {
      const [x, y] = middleOf(each);
      const along = (x - x0) * right + (y - y0) * down,
        across = Math.abs((x - x0) * down) + Math.abs((y - y0) * right);
      if (along > 1 && along + 2 * across < least) [best, least] = [each, along + 2 * across];
    }
    return best;
  };
  capture("keydown", (event) => {
    const { target, key } = event,
      group = target.closest?.(TOOLBAR);
    if (target.matches?.(HEAD) && (key === "Enter" || key === " ")) target.click();
    else if (group && ARROWS[key]) neighbour(itemsOf(group), target, ARROWS[key])?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  addEventListener("focusin", ({ target }) => {
    const group = target.closest?.(`${TOOLBAR}, [role=tablist]`);
    if (group) setStop(itemsOf(group), target);
  });
  return () => {
    all(`${TOOLBAR}, [role=tablist]`).forEach(markGroup);
    all(HEAD).forEach(markHead);
  };
})();
