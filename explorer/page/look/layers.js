// Keeps translucent surfaces of the workspace, and leaves, from hiding each other. viser has them write to the
// depth buffer, so that of two that overlap the second is lost, or not, from triangle to triangle.
window.explorer.layers ??= (() => {
  const FOLDERS = /^\/(workspace\/shell|leaves)\//;
  // Called before each frame, since viser makes materials anew.
  const mark = () => {
    for (const [name, node] of Object.entries(window.__viserMutable.nodeRefFromName)) {
      if (!node || !FOLDERS.test(name)) continue;
      node.traverse(({ material }) => {
        if (material) material.depthWrite = !material.transparent;
      });
    }
  };
  return { mark };
})();
