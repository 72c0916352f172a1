// Says since when the explorer does not answer, until it does.
window.explorer.connection ??= (() => {
  // The head of viser's main panel has this icon while there is a connection, and another one else.
  const HEAD = "[data-dock-unmergeable-header]",
    ICON = ".tabler-icon-cloud-check";
  const message = document.createElement("div");
  message.className = "ex-lost";
  message.setAttribute("role", "alert");
  let isSaved = false;
  const look = () => {
    if (document.querySelector(`${HEAD} ${ICON}`)) message.remove();
    else if (!message.isConnected) {
      const [time] = new Date().toTimeString().split(" ");
      const saved = isSaved ? "; your work is saved" : "";
      message.textContent = `The explorer has not answered since ${time}. The page asks again every few seconds${saved}.`;
      document.body.append(message);
      // The tour has gone with the connection.
      window.explorer.tour?.end();
    }
  };
  const watch = () => {
    const head = document.querySelector(HEAD);
    if (head) new MutationObserver(look).observe(head, { childList: true, subtree: true });
    else window.explorer.clock.atFrame(watch);
  };
  watch();
  return (saved) => {
    isSaved = saved;
  };
})();
