// Reports the size of the window, and whether its user prefers dark pages, to a text control.
window.explorer.window_facts ??= (uuid) => {
  const dark = matchMedia("(prefers-color-scheme: dark)").matches;
  window.explorer.send(uuid, JSON.stringify({ width: innerWidth, height: innerHeight, dark }));
};
