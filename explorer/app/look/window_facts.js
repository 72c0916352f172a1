// Reports the size of the window to a text control.
window.explorer.window_facts ??= (uuid) => {
  window.explorer.send(uuid, JSON.stringify({ width: innerWidth, height: innerHeight }));
};
