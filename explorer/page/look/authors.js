// Says of steps of the history which another browser did, in a list and in the hint of a button.
window.explorer.authors ??= (() => {
  const style = document.createElement("style");
  document.head.append(style);
  let own = null;
  const name = ({ target }) => {
    const button = target.closest?.("button"),
      author = button?.querySelector(".ex-author");
    if (!author || author.dataset.who === own) return;
    for (const words of ["title", "aria-label"]) {
      const text = button.getAttribute(words);
      if (text && !text.endsWith(author.textContent)) {
        button.setAttribute(words, text + author.textContent);
      }
    }
  };
  for (const event of ["pointerover", "focusin"]) addEventListener(event, name);
  return (number) => {
    own = `${number}`;
    style.textContent = `.ex-author[data-who="${own}"] { display: none }`;
  };
})();
