// Puts the stylesheet into the page, in place of an older one.
window.explorer.style ??= (() => {
  const element = document.createElement("style");
  document.head.append(element);
  return (css) => {
    element.textContent = css;
  };
})();
