// Names keys as viser's commands know them, by letters of the Latin alphabet and by digits. A key that
// writes a letter of another script, or a sign in the row of digits, goes by its place. A letter of a
// Latin keyboard stays what is written on it, wherever it is, and what a field receives is the same.
window.explorer.keys ??= (() => {
  // Letters and marks of scripts such as Cyrillic, Arabic or Thai; an Arabic key may write two.
  const IS_OTHER_SCRIPT = /^[^\p{Script=Latin}\p{Script=Common}]+$/u;
  const nameOf = ({ key, code, shiftKey }) => {
    const [, kind, name] = /^(Key|Digit)(.)$/.exec(code) ?? [];
    if (kind === "Key" && IS_OTHER_SCRIPT.test(key)) return name.toLowerCase();
    return kind === "Digit" && !shiftKey && !/^[a-z]/i.test(key) ? name : key;
  };
  window.explorer.capture("keydown", (event) =>
    Object.defineProperty(event, "key", { value: nameOf(event) }),
  );
  return true;
})();
