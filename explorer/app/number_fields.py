"""Number fields that take what is typed when it is finished, as those of CAD programs do.

viser's tell each key: half a number becomes a step of the history, an exponent loses its "e",
a field that holds no number stays so, what lies outside the range of a slider is moved into
it, and whatever comes from the explorer meanwhile wipes what is half typed. With this script
in the page a number counts once it is entered: by Enter, by leaving the field, or by a pause
in typing. What is no number, or Escape, brings back what was there.
"""

SCRIPT = """
(() => {
  if (window.explorerNumbers) return;
  window.explorerNumbers = true;
  const PAUSE = 700;
  // Wide enough for a sign and six digits.
  const style = document.createElement("style");
  style.textContent =
    '.mantine-NumberInput-root[style*="3rem"] { width: 3.9rem !important; flex: none; }';
  document.head.append(style);
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const isField = (it) => it instanceof HTMLInputElement && it.inputMode === "decimal";
  // The field that is typed into, what it held at first, and what the page last knew of.
  let typing = null;
  const numberIn = (text) => {
    const plain = text.trim().replace(/^\\u2212/, "-").replace(/^([^.,]*),([^.,]*)$/, "$1.$2");
    const value = /^[-+]?(\\d+\\.?\\d*|\\.\\d+)(e[-+]?\\d+)?$/i.test(plain) ? Number(plain) : NaN;
    return Math.abs(value) <= Number.MAX_SAFE_INTEGER ? value : null;
  };
  // The page's own fields know no exponents.
  const written = (value) =>
    value.toLocaleString("en", { useGrouping: false, maximumFractionDigits: 20 });
  // They work out what was typed from where the caret was: here, all was replaced.
  const tell = (field, from, to) => {
    write.call(field, from);
    field.setSelectionRange(0, from.length);
    field.dispatchEvent(new KeyboardEvent("keydown", { key: "Unidentified", bubbles: true }));
    write.call(field, to);
    field.setSelectionRange(to.length, to.length);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const enter = () => {
    const { field, before } = typing, value = numberIn(field.value);
    clearTimeout(typing.pause);
    typing.isPending = false;
    if (value === null) {
      write.call(field, before);
      return;
    }
    typing.before = written(value);
    typing.isTelling = true;
    tell(field, before, typing.before);
    typing.isTelling = false;
  };
  // The page writes its own number whenever it draws the field anew, in mid-word too.
  const hold = () => {
    const { field, text, caret } = typing;
    if (field.value === text) return;
    if (typing.first === typing.before) typing.first = field.value;
    typing.before = field.value;
    write.call(field, text);
    field.setSelectionRange(caret, caret);
  };
  const watch = () => {
    if (!typing || !typing.isPending) return;
    hold();
    requestAnimationFrame(watch);
  };
  const finish = () => {
    hold();
    enter();
  };
  const rest = () => {
    hold();
    // What a hand may be in the middle of, such as 0.0 on the way to 0.05, is left alone.
    const value = numberIn(typing.field.value);
    if (value !== null && written(value) === typing.field.value) enter();
  };
  // A field whose page is not told that it was left takes the focus back with its next number.
  const leave = (field) => { field.focus = field.setSelectionRange = () => {}; };
  const comeBack = (field) => { delete field.focus; delete field.setSelectionRange; };
  const begun = (field) => ({ field, first: field.value, before: field.value });
  addEventListener("focusin", ({ target }) => {
    if (isField(target)) comeBack(target);
    typing = isField(target) ? begun(target) : null;
  }, true);
  addEventListener("input", (event) => {
    if (!isField(event.target)) return;
    if (!typing || typing.field !== event.target) {
      typing = begun(event.target);
    }
    if (typing.isTelling) return;
    event.stopPropagation();
    clearTimeout(typing.pause);
    typing.pause = setTimeout(rest, PAUSE);
    typing.text = typing.field.value;
    typing.caret = typing.field.selectionStart;
    if (!typing.isPending) requestAnimationFrame(watch);
    typing.isPending = typing.isEdited = true;
  }, true);
  addEventListener("keydown", (event) => {
    const { target, key } = event;
    if (!typing || typing.field !== target || typing.isTelling) return;
    if (typing.isPending) hold();
    if (typing.isEdited && key === "Escape") {
      write.call(target, typing.first);
      enter();
    }
    if (typing.isPending && ["Enter", "Tab", "ArrowUp", "ArrowDown"].includes(key)) enter();
    // The page's field would go by a text that it does not know.
    const isTyped = key.length === 1 && !event.ctrlKey && !event.metaKey;
    if (isTyped || ["Backspace", "Delete", "ArrowLeft", "ArrowRight"].includes(key)) {
      event.stopPropagation();
    }
  }, true);
  // Before the field is left: once it is told of a number it takes the focus back.
  addEventListener("pointerdown", ({ target }) => {
    if (typing && typing.isPending && typing.field !== target) finish();
    // The arrows of a field call for its focus.
    const field = target.closest?.(".mantine-NumberInput-root")?.querySelector("input");
    if (field) comeBack(field);
  }, true);
  addEventListener("change", (event) => {
    if (!typing || typing.field !== event.target || !typing.isPending) return;
    event.stopPropagation();
    finish();
  }, true);
  addEventListener("focusout", (event) => {
    if (!typing || typing.field !== event.target) return;
    if (typing.isPending) finish();
    // The page would move the number into the range, which is about to follow the number.
    if (typing.isEdited) {
      event.stopPropagation();
      leave(typing.field);
    }
    typing = null;
  }, true);
})();
"""
"""Makes the number fields of a browser behave so."""
