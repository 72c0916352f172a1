window.explorer ??= {};

// Sends a value to the server as that of a hidden text or number field of ours.
window.explorer.send ??= (uuid, value) => {
  const message = { type: "GuiUpdateMessage", uuid, updates: { value } };
  window.__viserMutable?.sendMessage?.(message);
};
// What this browser remembers, whatever the port of the explorer.
window.explorer.recall ??= (name) =>
  document.cookie.match(`(?:^|; )explorer-${name}=([^;]*)`)?.[1] ?? null;
window.explorer.keep ??= (name, value) => {
  document.cookie = `explorer-${name}=${value}; path=/; max-age=31536000; samesite=strict`;
};
// Calls a function at events of a type, before what they happen to hears of them.
window.explorer.capture ??= (type, run) => addEventListener(type, run, true);
