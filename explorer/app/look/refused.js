// Shows why the page may not connect. It comes inside the page, since all other scripts come
// through the connection.
(() => {
  // Failures in a row, none of them a refusal of the explorer, after which the page shows why.
  const MANY = 4;
  let failures = 0,
    card = null;
  const show = (reason) => {
    if (!card) {
      card = document.createElement("div");
      card.className = "ex-refused";
      card.setAttribute("role", "alert");
      const title = document.createElement("b");
      title.textContent = "This page may not connect";
      card.append(title, document.createElement("p"));
      document.body.append(card);
    }
    card.lastChild.textContent = reason;
  };
  const hide = () => {
    card?.remove();
    card = null;
  };
  const ask = async () => {
    failures += 1;
    const attempt = failures;
    try {
      const question = `connection?origin=${encodeURIComponent(location.origin)}`;
      const response = await fetch(question, { cache: "no-store" });
      const reason = await response.text();
      // It may have connected meanwhile; and a proxy has error pages of its own.
      const isOurs = response.headers.get("Content-Type")?.startsWith("text/plain");
      if (failures < attempt || !isOurs) return;
      if (!response.ok || failures >= MANY) show(reason);
    } catch {
      // The explorer has stopped, or the network is down: the page goes on trying.
      hide();
    }
  };
  // The websocket lives in a worker of viser's page, which reports its state to the page.
  window.Worker = class extends window.Worker {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", ({ data }) => {
        if (data?.type === "closed") void ask();
        if (data?.type !== "connected") return;
        failures = 0;
        hide();
      });
    }
  };
})();
