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
// Says beside a drawing what is under the pointer, or else what a pointer does there.
window.explorer.tell ??= (drawing, words) => {
  const reading = drawing?.parentElement?.querySelector(".ex-reading");
  const wanted = words ?? reading?.dataset.hint;
  if (reading && reading.textContent !== wanted) reading.textContent = wanted;
};
// Calls a function at events of a type, before what they happen to hears of them.
window.explorer.capture ??= (type, run) => addEventListener(type, run, true);
// All elements of a selector, as an array.
window.explorer.all ??= (selector) => [...document.querySelectorAll(selector)];
// An element with some properties.
window.explorer.make ??= (tag, properties) =>
  Object.assign(document.createElement(tag), properties);
// Calls a function after changes of the page, of kinds that a MutationObserver knows.
window.explorer.watch ??= (run, kinds = { childList: true }) =>
  new MutationObserver(run).observe(document.body, { subtree: true, ...kinds });
