// Shows the card of the tour or a lesson, turns to the tab of its step and rings the control that the
// step names. Without a card it turns back to the tabs that were in front before.
window.explorer.tour ??= (() => {
  const { all, recall, keep, make } = window.explorer;
  const DRAWER = "[data-floating-window][data-ex=drawer]";
  const CLOSED = `${DRAWER}:has([data-dock-bar])`,
    CLOSE = `${DRAWER} [data-dock-minimize]`;
  const FRONT = "[data-dock-strip] > [aria-selected=true]:not([data-ex=dialog] *)";
  const card = make("div", { className: "ex-tour", role: "region" });
  // What was in front before the tour; null without a tour.
  let before = null;
  // The step whose tab is in front, and the wanted one.
  let shown = null,
    wanted = null;
  let ringed = null;
  const isClosed = () => document.querySelector(CLOSED) !== null;
  const ring = (element) => {
    if (ringed) delete ringed.dataset.exRing;
    ringed = element;
    if (!ringed) return;
    ringed.dataset.exRing = "";
    ringed.scrollIntoView({ block: "nearest" });
  };
  // `labels.js` draws the ring.
  const ringHandle = (isRinged) => {
    window.explorer.ringsHandle = isRinged;
    window.__viserMutable?.requestRender();
  };
  const turn = () => {
    const titles = all(FRONT).map((tab) => tab.title);
    before ??= { titles, wasClosed: isClosed() };
    shown = wanted;
    ring(null);
    window.explorer.open(shown.tab);
  };
  // Panels come after the tour, and names of controls a little after their tab. A phone has neither.
  const follow = () => {
    if (shown?.number !== wanted.number && document.querySelector(DRAWER)) turn();
    if (shown?.number !== wanted.number || ringed?.isConnected) return;
    const control = wanted.control ? document.querySelector(wanted.control) : null;
    // A slider is ringed with its words and its field.
    ring(control?.matches("[role=slider]") ? window.explorer.names.rowOf(control) : control);
  };
  const changes = { childList: true, subtree: true, attributeFilter: ["aria-label"] };
  const watch = new MutationObserver(follow);
  const end = () => {
    watch.disconnect();
    card.remove();
    ring(null);
    ringHandle(false);
    before?.titles.forEach((title) => window.explorer.open(title));
    if (before?.wasClosed && !isClosed()) document.querySelector(CLOSE)?.click();
    before = shown = wanted = null;
  };
  // A browser that has seen the tour to its end, or skipped it, is not offered it again.
  const offer = () => {
    if (recall("tour")) return;
    if (window.explorer.press) window.explorer.press("tour", "offer");
    else window.explorer.clock.atFrame(offer);
  };
  const show = (html, step) => {
    if (!html) {
      keep("tour", "seen");
      end();
      return;
    }
    card.innerHTML = html;
    card.ariaLabel = step.title;
    if (!card.isConnected) document.body.append(card);
    wanted = step;
    follow();
    watch.observe(document.body, changes);
    ringHandle(step.ringsHandle);
  };
  return Object.assign(show, { offer, end });
})();
