// Draws only what has changed in our markup. The page replaces all elements of a piece of markup
// whenever a number in it changes: a press, the focus or a pointer that rests on one would meet
// another one.
window.explorer.markup ??= (() => {
  const { get, set } = Object.getOwnPropertyDescriptor(Element.prototype, "innerHTML");
  const isOurs = (html) => /\bclass="?ex-/.test(html);
  const parse = (html) => {
    const template = document.createElement("template");
    set.call(template, html);
    return template.content;
  };
  // What an element does: one that does something else is another one.
  const DOES = ["data-press", "data-value", "data-opens", "data-hover", "id"];
  const isAlike = (one, other) =>
    one.nodeName === other.nodeName &&
    (one.nodeType !== Node.ELEMENT_NODE ||
      DOES.every((name) => one.getAttribute(name) === other.getAttribute(name)));
  const patchAttributes = (element, before, after) => {
    for (const { name, value } of after.attributes) {
      if (before.getAttribute(name) !== value) element.setAttribute(name, value);
    }
    for (const { name } of before.attributes) {
      if (!after.hasAttribute(name)) element.removeAttribute(name);
    }
  };
  // Changes a node that was drawn from one template so that it is as from another one. What scripts
  // have written into it stays where the templates are the same.
  const patch = (node, before, after) => {
    if (before.isEqualNode(after)) return;
    if (!isAlike(before, after) || !isAlike(node, before)) {
      node.replaceWith(after.cloneNode(true));
    } else if (node.nodeType === Node.ELEMENT_NODE) {
      patchAttributes(node, before, after);
      patchChildren(node, before, after);
    } else node.nodeValue = after.nodeValue;
  };
  const patchChildren = (node, before, after) => {
    const [nodes, old, wanted] = [node, before, after].map(({ childNodes }) =>
      Array.from(childNodes),
    );
    if (nodes.length !== old.length) {
      node.replaceChildren(...wanted.map((each) => each.cloneNode(true)));
      return;
    }
    wanted.forEach((each, k) => {
      if (k < nodes.length) patch(nodes[k], old[k], each);
      else node.append(each.cloneNode(true));
    });
    for (const each of nodes.slice(wanted.length)) each.remove();
  };
  // The template from which each element's markup is drawn.
  const templates = new WeakMap();
  Object.defineProperty(Element.prototype, "innerHTML", {
    configurable: true,
    enumerable: true,
    get,
    set(html) {
      const before = templates.get(this),
        after = isOurs(html) ? parse(html) : null;
      if (before && after) patchChildren(this, before, after);
      else set.call(this, html);
      if (after) templates.set(this, after);
      else templates.delete(this);
    },
  });
  return true;
})();
