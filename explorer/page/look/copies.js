// Copies a text to the clipboard. Pages of another machine without TLS have no clipboard of their
// own, so that a selected field is copied there.
window.explorer.copies ??= async (text) => {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const field = window.explorer.make("textarea", { value: text });
    document.body.append(field);
    field.select();
    document.execCommand("copy");
    field.remove();
  }
};
