// What viser's page receives of the explorer, heard before the page does: viser keeps its connection in
// a worker. It can also be told to connect anew.
window.explorer.socket ??= (() => {
  const listeners = new Set();
  let worker = null;
  window.Worker = class extends Worker {
    constructor(...all) {
      super(...all);
      this.addEventListener("message", ({ data }) => {
        worker = this;
        for (const listen of listeners) listen(data);
      });
    }
  };
  return {
    listen: (listener) => listeners.add(listener),
    unlisten: (listener) => listeners.delete(listener),
    connect: () => worker?.postMessage({ type: "retry" }, []),
  };
})();
