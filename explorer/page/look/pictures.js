// What the headless browser that takes pictures does with a page.

// Lets a page prepare many frames and draw none before the one that is wanted, and none after it:
// each takes a software renderer as long as all else together.
window.explorer.hold ??= () => {
  window.isReleased = false;
  const context = WebGL2RenderingContext.prototype;
  for (const name of [
    "clear",
    "drawArrays",
    "drawElements",
    "drawArraysInstanced",
    "drawElementsInstanced",
    "drawRangeElements",
  ]) {
    const draw = context[name];
    context[name] = function (...all) {
      if (window.isReleased) draw.apply(this, all);
    };
  }
};

// Waits for a number of frames to be drawn, and until the browser has taken the last of them.
window.explorer.awaitFrames ??= (count) =>
  new Promise((resolve) => {
    // A renderer whose context was lost counts anew.
    const { render } = window.__viserMutable.scene.__r3f.root.getState().gl.info;
    const last = render.frame + count;
    const next = () => {
      if (render.frame < last) {
        window.__viserMutable.requestRender();
        requestAnimationFrame(next);
      } else requestAnimationFrame(resolve);
    };
    next();
  });

// Draws one frame on a page on hold.
window.explorer.drawFrame ??= () =>
  new Promise((resolve) => {
    const { scene, requestRender } = window.__viserMutable;
    const [before, after] = [scene.onBeforeRender, scene.onAfterRender];
    scene.onBeforeRender = (...all) => {
      window.isReleased = true;
      before(...all);
    };
    scene.onAfterRender = (...all) => {
      after(...all);
      Object.assign(scene, { onBeforeRender: before, onAfterRender: after });
      window.isReleased = false;
      requestAnimationFrame(resolve);
    };
    requestRender();
  });

// Whether nothing fades or glides any more; what turns without an end, such as a sign that
// something is loading, is left out.
window.explorer.isStill ??= () =>
  document
    .getAnimations()
    .every(
      ({ playState, effect }) =>
        playState !== "running" || effect.getTiming().iterations === Infinity,
    );
