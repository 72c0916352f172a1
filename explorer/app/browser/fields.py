"""Number fields that take what is typed when it is finished, as those of CAD programs do.

viser's tell each key: half a number becomes a step of the history, an exponent loses its "e",
a field that holds no number stays so, what lies outside the range of a slider is moved into
it, and whatever comes from the explorer meanwhile wipes what is half typed. With this script
in the page a number counts once it is entered: by Enter, by leaving the field, or by a pause
in typing. What is no number, or Escape, brings back what was there; and undo is the explorer's.

A line of text may hold blanks and be emptied and typed anew; left empty, it gets back what it
held. Enter leaves both, so that the next key is a command again; a pointer that has ticked a box
or chosen an option leaves it likewise. And the arrows move a slider alone, not the camera too.
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
    // Full width, as from an input method of East Asia, is as good.
    const plain = text.normalize("NFKC").trim()
      .replace(/^\\u2212/, "-").replace(/^([^.,]*),([^.,]*)$/, "$1.$2");
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
    if (value === null) {
      giveUp();
      return;
    }
    clearTimeout(typing.pause);
    typing.isPending = false;
    typing.before = written(value);
    typing.isTelling = true;
    tell(field, before, typing.before);
    typing.isTelling = false;
  };
  // The page writes its own number whenever it draws the field anew, in mid-word too.
  const hold = () => {
    const { field, text, chosen } = typing;
    if (field.value === text) return;
    if (typing.first === typing.before) typing.first = field.value;
    typing.before = field.value;
    write.call(field, text);
    field.setSelectionRange(...chosen);
  };
  const choose = () => {
    typing.chosen = [typing.field.selectionStart, typing.field.selectionEnd];
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
  const wait = () => {
    clearTimeout(typing.pause);
    typing.pause = setTimeout(rest, PAUSE);
  };
  const giveUp = () => {
    clearTimeout(typing.pause);
    typing.isPending = false;
    write.call(typing.field, typing.before);
  };
  // viser hears no keys of fields.
  const tellAll = ({ key, code, ctrlKey, metaKey, shiftKey }) => {
    const init = { key, code, ctrlKey, metaKey, shiftKey, bubbles: true };
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", init));
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
    wait();
    // Nothing may be written into what an input method is at.
    if (event.isComposing) clearTimeout(typing.pause);
    typing.text = typing.field.value;
    choose();
    if (!typing.isPending) requestAnimationFrame(watch);
    typing.isPending = typing.isEdited = true;
  }, true);
  // The page would take every comma for a point, and tell of it past all this.
  addEventListener("paste", (event) => {
    if (isField(event.target)) event.stopPropagation();
  }, true);
  addEventListener("beforeinput", (event) => {
    const { target, inputType } = event;
    if (!isField(target)) return;
    // The browser knows nothing of what was written into its fields, and undoes it wrongly.
    if (inputType.startsWith("history")) event.preventDefault();
    // The explorer may have written another number since.
    if (typing && typing.field === target && !typing.isPending) typing.before = target.value;
  }, true);
  addEventListener("compositionend", ({ target }) => {
    if (typing && typing.field === target && typing.isPending) wait();
  }, true);
  document.addEventListener("selectionchange", () => {
    if (typing && typing.isPending && typing.field.value === typing.text) choose();
  });
  addEventListener("keydown", (event) => {
    const { target, key } = event;
    if (!typing || typing.field !== target || typing.isTelling || event.isComposing) return;
    if (typing.isPending) hold();
    if ((event.ctrlKey || event.metaKey) && /^[zy]$/i.test(key)) {
      event.preventDefault();
      event.stopPropagation();
      if (typing.isPending) giveUp();
      else tellAll(event);
      return;
    }
    if (typing.isEdited && key === "Escape") {
      write.call(target, typing.first);
      enter();
    }
    if (typing.isPending && ["Enter", "Tab", "ArrowUp", "ArrowDown"].includes(key)) enter();
    if (key === "Enter") {
      event.stopPropagation();
      target.blur();
      return;
    }
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

  // A line of text says nothing new while it is empty or ends with a blank: there a word is begun.
  let line = null;
  const isLine = (it) => it instanceof HTMLInputElement && !!it.closest(".mantine-TextInput-root");
  addEventListener("focusin", ({ target }) => {
    line = isLine(target) ? { field: target, before: target.value } : null;
  }, true);
  addEventListener("input", (event) => {
    if (line && line.field === event.target && !/\\S$/.test(line.field.value)) {
      event.stopPropagation();
    }
  }, true);
  addEventListener("keydown", (event) => {
    if (event.key !== "Enter" || event.isComposing || !isLine(event.target)) return;
    event.stopPropagation();
    event.target.blur();
  }, true);
  addEventListener("focusout", ({ target }) => {
    if (!line || line.field !== target) return;
    const text = target.value.trim() || line.before;
    line = null;
    if (text === target.value) return;
    write.call(target, text);
    target.dispatchEvent(new Event("input", { bubbles: true }));
  }, true);

  // A box that was ticked or an option that was chosen with a pointer would keep all keys to
  // itself; a hand on the keyboard keeps its place.
  document.addEventListener("click", ({ detail, target }) => {
    if (!detail || !target.closest("input[type=checkbox], [role=option]")) return;
    setTimeout(() => document.activeElement?.blur());
  });

  // After the page's own listeners, before viser's, which turns the camera.
  document.body.addEventListener("keydown", (event) => {
    const isOnSlider = event.target.closest?.(".mantine-Slider-root");
    if (isOnSlider && event.key.startsWith("Arrow")) event.stopPropagation();
  });
})();
"""
"""Makes the inputs of a browser behave so."""
