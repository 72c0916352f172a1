// Gives each control the words beside it as its name for screen readers.
window.explorer.names ??= (() => {
  const CONTROLS =
    "[role=slider], input:not([type=hidden]):not([type=file]):not([type=checkbox]), textarea";
  // Names of buttons by their icon.
  const ICONS = {
    "list-search": "Commands",
    adjustments: "Settings of the page",
    "arrow-back": "Back to the controls",
  };
  const AXES = ["x", "y", "z"];
  const name = (it, words) => {
    if (words && it.getAttribute("aria-label") !== words) it.setAttribute("aria-label", words);
  };
  // The smallest part of the page that holds a control and the words beside it.
  const rowOf = (control) => {
    for (let row = control.parentElement; row; row = row.parentElement) {
      if (row.querySelector("label[for]")) return row;
    }
    return null;
  };
  const nameControl = (control) => {
    const row = rowOf(control);
    const labels = row ? row.querySelectorAll("label[for]") : [];
    // Several labels belong to several controls: this one has no words of its own.
    if (labels.length !== 1) return;
    const words = labels[0].textContent.replace(/\s+/g, " ").trim();
    const fields = [...row.querySelectorAll("input[inputmode=decimal]")];
    name(control, fields.length === 3 ? `${words} ${AXES[fields.indexOf(control)]}` : words);
  };
  const nameButton = (button) => {
    if (button.matches(".mantine-Notification-closeButton")) name(button, "Close");
    for (const [icon, words] of Object.entries(ICONS)) {
      if (button.querySelector(`.tabler-icon-${icon}`)) name(button, words);
    }
  };
  let isDue = false;
  const nameAll = () => {
    isDue = false;
    document.querySelectorAll(CONTROLS).forEach(nameControl);
    document.querySelectorAll("button").forEach(nameButton);
  };
  const nameSoon = () => {
    if (!isDue) setTimeout(nameAll, 100);
    isDue = true;
  };
  const changes = { childList: true, characterData: true, subtree: true };
  new MutationObserver(nameSoon).observe(document.body, changes);
  nameAll();
  return true;
})();
