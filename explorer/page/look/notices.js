// Makes viser's notice that there is no graphics card a short one, blue as all that only tells
// something, which closes by itself and is shown once in a browser.
window.explorer.notices ??= (() => {
  const { clock, recall, keep } = window.explorer;
  const ID = "webgl-software-rendering",
    KEY = "software";
  const WORDS = "Drawn without a graphics card: moving the scene may be slow.";
  // Milliseconds until it closes.
  const LASTS = 8000;
  const notice = document.getElementById(ID);
  const close = () => notice.querySelector("button")?.click();
  if (!notice) return true;
  if (recall(KEY)) close();
  else {
    notice.querySelector(".mantine-Notification-title").textContent = WORDS;
    notice.querySelector(".mantine-Notification-description").style.display = "none";
    notice.style.setProperty("--notification-color", "var(--mantine-color-blue-filled)");
    clock.after(LASTS, close);
  }
  keep(KEY, "seen");
  return true;
})();
