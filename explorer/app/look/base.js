window.explorer ??= {};

// Sends a value to the server as that of a hidden text or number field of ours.
window.explorer.send ??= (uuid, value) => {
  const message = { type: "GuiUpdateMessage", uuid, updates: { value } };
  window.__viserMutable?.sendMessage?.(message);
};
