// Lets the page do without WebGL, and makes the scene anew where the browser has lost and found it.
window.explorer.graphics ??= (() => {
  const MISSING =
    "The scene needs WebGL: switch on graphics acceleration in the settings of the browser, and load the page again. All else works without it.";
  const LOST = "The browser has lost its graphics. The scene is drawn again once it has them back.";
  const message = window.explorer.make("p", { className: "ex-undrawn", role: "status" });
  const tell = (words) => {
    message.textContent = words;
    document.body.append(message);
  };

  // In the place of WebGL: answers what three.js asks at its start, and draws nothing.
  const standIn = (canvas) => {
    const names = window.WebGL2RenderingContext ?? {};
    const parameters = {
      [names.VERSION]: "WebGL 2.0",
      [names.SCISSOR_BOX]: [0, 0, 1, 1],
      [names.VIEWPORT]: [0, 0, 1, 1],
    };
    const answers = {
      canvas,
      getContextAttributes: () => ({}),
      getParameter: (name) => parameters[name] ?? 0,
      getShaderPrecisionFormat: () => ({ precision: 23, rangeMin: 127, rangeMax: 127 }),
    };
    return new Proxy(answers, { get: (_, name) => answers[name] ?? names[name] ?? (() => null) });
  };
  const prototype = HTMLCanvasElement.prototype,
    getContext = prototype.getContext;
  prototype.getContext = function (kind, ...rest) {
    const context = getContext.call(this, kind, ...rest);
    if (context || kind !== "webgl2") return context;
    tell(MISSING);
    // Three.js draws nothing once it believes that the context is lost.
    queueMicrotask(() => this.dispatchEvent(new Event("webglcontextlost")));
    return standIn(this);
  };

  const forEachDrawn = (run) =>
    window.__viserMutable.scene.traverse((each) => each.geometry && run(each));
  const lose = ({ isTrusted, target }) => {
    if (!isTrusted || target !== window.__viserMutable?.canvas) return;
    tell(LOST);
    forEachDrawn((each) => {
      // What lies in the lost context could not be deleted later, from the new one.
      each.geometry.dispose();
      // Copies of one mesh have a buffer and programs of their own, of which three.js does not know
      // that they are lost.
      if (!each.isInstancedMesh2) return;
      each.dispose();
      each.material = each.material.clone();
    });
  };
  const find = ({ target }) => {
    if (target !== window.__viserMutable?.canvas) return;
    message.remove();
    forEachDrawn((each) => each.isInstancedMesh2 && each.initIndexAttribute());
  };
  window.explorer.capture("webglcontextlost", lose);
  window.explorer.capture("webglcontextrestored", find);
  return true;
})();
