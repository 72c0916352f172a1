// Lets number fields take a value only when it is complete, lets lines of text be emptied and typed
// again, and sends keys where a user expects them.
window.explorer.fields ??= (() => {
  // Milliseconds of rest after which a typed number is entered.
  const PAUSE = 700;
  const { capture, clock, make } = window.explorer;
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const { setSelectionRange } = HTMLInputElement.prototype;
  const isField = (it) => it instanceof HTMLInputElement && it.inputMode === "decimal";
  // The field with the focus, its number at first, the number that the page last knew of, the text
  // that stands in it, and the ends of the selection.
  let typing = null;
  // Units of length that may be typed, in millimetres; a design unit is that of the design.
  const LENGTHS = { mm: 1, cm: 10, m: 1000, in: 25.4, '"': 25.4 };
  const ofUnits = (unit) =>
    /^(design )?units?$/.test(unit)
      ? Number(document.querySelector("[data-unit-mm]")?.dataset.unitMm)
      : LENGTHS[unit];
  const unitOf = (field) => window.explorer.names.unitOf(field);
  const numberIn = (text, unit) => {
    // Full-width characters, as from an input method of East Asia, count too.
    const plain = text
      .normalize("NFKC")
      .trim()
      .replace(/^\u2212/, "-")
      .replace(/^([^.,]*),([^.,]*)$/, "$1.$2");
    const parts = /^([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*(.*)$/i.exec(plain);
    if (!parts) return null;
    const [, number, typed] = parts,
      factor = !typed || typed === unit ? 1 : ofUnits(typed) / ofUnits(unit);
    // Of fifteen digits, so that 0.3 cm are 3 mm.
    const value = factor === 1 ? Number(number) : Number((number * factor).toPrecision(15));
    return Math.abs(value) <= Number.MAX_SAFE_INTEGER ? value : null;
  };
  // Milliseconds for which a refusal stays.
  const LIFE = 6000;
  // Shows below a field what it takes, until another field has the focus.
  const explain = (field, unit) => {
    document.querySelector(".ex-refusal")?.remove();
    const allowed = Number.isFinite(ofUnits(unit))
      ? `length: type a number in ${unit}, such as 0.3, or one with its unit: 3 mm, 2 cm, 1 in, 4 units`
      : "number: type one such as 0.3 or 0,3";
    const { left, bottom } = field.getBoundingClientRect(),
      textContent = `“${field.value.slice(0, 20)}” is no ${allowed}.`,
      note = make("div", { className: "ex-refusal", role: "alert", textContent });
    note.style.cssText = `--left: ${Math.min(left, innerWidth - 270)}px; --top: ${bottom + 4}px`;
    document.body.append(note);
    clock.after(LIFE, () => note.remove());
  };
  // The page's number fields take no exponents.
  const plainText = (value) =>
    value.toLocaleString("en", {
      useGrouping: false,
      maximumFractionDigits: 20,
      signDisplay: "negative",
    });
  // The page's fields infer the typed text from the caret: here, all of it was replaced.
  const replaceText = (field, from, to) => {
    write.call(field, from);
    setSelectionRange.call(field, 0, from.length);
    field.dispatchEvent(new KeyboardEvent("keydown", { key: "Unidentified", bubbles: true }));
    write.call(field, to);
    setSelectionRange.call(field, to.length, to.length);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const enter = () => {
    const { field, before } = typing,
      unit = unitOf(field),
      value = numberIn(field.value, unit);
    if (value === null) {
      if (field.value.trim()) explain(field, unit);
      giveUp();
      return;
    }
    clock.cancel(typing.pause);
    typing.isPending = false;
    typing.before = typing.text = plainText(value);
    typing.isReplacing = true;
    replaceText(field, before, typing.before);
    typing.isReplacing = false;
    choose();
  };
  const choose = () => {
    typing.chosen = [typing.field.selectionStart, typing.field.selectionEnd];
  };
  // The page writes its own number whenever it redraws the field or a number arrives, even while a
  // user types, or has selected all to type another number.
  const hold = () => {
    const { field, text, chosen } = typing;
    if (field.value === text) return;
    if (typing.first === typing.before) typing.first = field.value;
    typing.before = field.value;
    if (typing.isPending) {
      write.call(field, text);
      setSelectionRange.call(field, ...chosen);
      return;
    }
    typing.text = field.value;
    if (chosen[0] === 0 && chosen[1] === text.length) field.select();
    choose();
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
    // A number that may be unfinished, such as 0.0 on the way to 0.05, is not entered.
    const value = numberIn(typing.field.value, "");
    if (value !== null && plainText(value) === typing.field.value) enter();
  };
  const wait = () => {
    clock.cancel(typing.pause);
    typing.pause = clock.after(PAUSE, rest);
  };
  const giveUp = () => {
    clock.cancel(typing.pause);
    typing.isPending = false;
    typing.text = typing.before;
    write.call(typing.field, typing.before);
    choose();
  };
  const startTyping = (field) => {
    document.querySelector(".ex-refusal")?.remove();
    // The page would set the caret with each number.
    field.setSelectionRange = () => {};
    const { value } = field;
    typing = { field, first: value, before: value, text: value };
    choose();
  };
  capture("focusin", ({ target }) => {
    typing = null;
    if (!isField(target)) return;
    delete target.focus;
    startTyping(target);
  });
  capture("input", (event) => {
    if (!isField(event.target)) return;
    if (typing?.field !== event.target) startTyping(event.target);
    if (typing.isReplacing) return;
    event.stopPropagation();
    wait();
    // Nothing may be written into the field while an input method composes text.
    if (event.isComposing) clock.cancel(typing.pause);
    typing.text = typing.field.value;
    choose();
    if (!typing.isPending) requestAnimationFrame(watch);
    typing.isPending = typing.isEdited = true;
  });
  // The page would turn every comma into a point and report the number itself.
  capture("paste", (event) => isField(event.target) && event.stopPropagation());
  capture("beforeinput", (event) => {
    const { target, inputType } = event;
    if (!isField(target)) return;
    // The browser does not know what scripts wrote into its fields, and would undo wrongly.
    if (inputType.startsWith("history")) event.preventDefault();
    // The explorer may have written another number since.
    if (typing && typing.field === target) hold();
  });
  capture("compositionend", ({ target }) => typing?.field === target && typing.isPending && wait());
  document.addEventListener("selectionchange", () => {
    if (!typing || typing.isReplacing) return;
    if (typing.field.value === typing.text) choose();
    else hold();
  });
  capture("keydown", (event) => {
    const { target, key } = event;
    if (!typing || typing.field !== target || typing.isReplacing || event.isComposing) return;
    hold();
    const isForPage = event.ctrlKey || event.metaKey;
    if (typing.isPending && isForPage && /^[zy]$/i.test(key)) {
      event.preventDefault();
      event.stopPropagation();
      giveUp();
      return;
    }
    if (typing.isPending && isForPage && /^s$/i.test(key)) enter();
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
    // The page's field would act on a text that it does not know.
    const isTyped = key.length === 1 && !event.ctrlKey && !event.metaKey;
    if (isTyped || /^(Backspace|Delete|ArrowLeft|ArrowRight)$/.test(key)) event.stopPropagation();
  });
  // This runs before the field loses the focus, since a field that gets a number takes it back.
  capture("pointerdown", ({ target }) => {
    if (typing && typing.field === target) hold();
    else if (typing && typing.isPending) finish();
    // The arrows of a field need its focus.
    const field = target.closest?.(".mantine-NumberInput-root")?.querySelector("input");
    if (field) delete field.focus;
  });
  capture("change", (event) => {
    if (!typing || typing.field !== event.target || !typing.isPending) return;
    event.stopPropagation();
    finish();
  });
  capture("focusout", (event) => {
    if (!typing || typing.field !== event.target) return;
    if (typing.isPending) finish();
    // The page would clamp the number to the range, although the range is about to follow it. The
    // field, of whose focusout it is not told, would take the focus back with its next number.
    if (typing.isEdited) {
      event.stopPropagation();
      typing.field.focus = () => {};
    }
    typing = null;
  });

  // A line of text reports no change while it is empty or ends with a blank: more is being typed.
  let line = null;
  const isLine = (it) => it instanceof HTMLInputElement && !!it.closest(".mantine-TextInput-root");
  capture("focusin", ({ target }) => {
    line = isLine(target) ? { field: target, before: target.value } : null;
  });
  capture("input", (event) => {
    if (line?.field === event.target && !/\S$/.test(event.target.value)) event.stopPropagation();
  });
  capture("keydown", (event) => {
    if (event.key !== "Enter" || event.isComposing || !isLine(event.target)) return;
    event.stopPropagation();
    event.target.blur();
  });
  // What these keys do for the whole page they do wherever the focus is; text that is being typed is
  // the browser's to undo.
  capture("keydown", (event) => {
    const { target, key, ctrlKey, metaKey, shiftKey, isTrusted, defaultPrevented } = event;
    if (!isTrusted || defaultPrevented || !(ctrlKey || metaKey) || !/^[zys]$/i.test(key)) return;
    if (!/s/i.test(key)) {
      const isTyped = line?.field === target && target.value !== line.before;
      if (isTyped || !target.matches?.("input:not([type=search]), textarea, select")) return;
    }
    event.preventDefault();
    event.stopPropagation();
    // viser ignores keys pressed in fields. Its commands go by the key, its camera by the place alone.
    const init = { key, ctrlKey, metaKey, shiftKey, bubbles: true };
    document.documentElement.dispatchEvent(new KeyboardEvent("keydown", init));
  });
  capture("focusout", ({ target }) => {
    if (!line || line.field !== target) return;
    const text = target.value.trim() || line.before;
    line = null;
    if (text === target.value) return;
    write.call(target, text);
    target.dispatchEvent(new Event("input", { bubbles: true }));
  });

  // A checkbox or option that was clicked would keep all keys to itself, so it loses the focus; one
  // that was chosen with the keyboard keeps it.
  document.addEventListener("click", ({ detail, target }) => {
    if (!detail || !target.closest("input[type=checkbox], [role=option]")) return;
    clock.after(0, () => document.activeElement?.blur());
  });

  // This listener runs after the page's own and before viser's, which turns the camera.
  document.body.addEventListener("keydown", (event) => {
    const isOnSlider = event.target.closest?.(".mantine-Slider-root");
    if (isOnSlider && event.key.startsWith("Arrow")) event.stopPropagation();
  });
  return true;
})();
