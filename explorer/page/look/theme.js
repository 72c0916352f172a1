// The theme of the page: light or dark as its user chose in this browser, or else as the system is. It
// is sent to the server, whose colours follow it.
window.explorer.theme ??= (() => {
  const { recall, keep, press } = window.explorer;
  const KEY = "theme";
  const system = matchMedia("(prefers-color-scheme: dark)");
  const nameOf = (isDark) => (isDark ? "dark" : "light");
  let choice = recall(KEY) ?? "system";
  const SIGNS = { system: "◐", dark: "☾", light: "☀" };
  const send = () => {
    document.documentElement.style.setProperty("--ex-theme", `"${SIGNS[choice]}"`);
    press("theme", choice === "system" ? nameOf(system.matches) : choice);
  };
  system.addEventListener("change", send);
  const turn = () => {
    const order = ["system", nameOf(!system.matches), nameOf(system.matches)];
    choice = order[(order.indexOf(choice) + 1) % order.length];
    keep(KEY, choice);
    send();
  };
  return Object.assign(send, { turn });
})();
