// Sends whether the window is too narrow for panels on both sides of the scene, and high enough for
// one above the other, in pixels.
window.explorer.room ??= (narrow, high) => {
  const { press, clock } = window.explorer;
  const ask = () => window.explorer.room(narrow, high);
  if (press) press("room", innerWidth < narrow && innerHeight >= high ? "narrow" : "wide");
  else clock.atFrame(ask);
};
