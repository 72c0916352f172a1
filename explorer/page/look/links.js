// Takes the state in the fragment of the address, which is no part of a request, before viser's page
// makes the address of its connection of it, and drops it, so that loading the page again keeps what
// was done since. Copies links: the address without its token, and a fragment.
window.explorer.openLink ??= (() => {
  let name = null,
    fragment = "";
  const open = () => {
    if (name && fragment) window.explorer.press(name, fragment);
    if (name) fragment = "";
  };
  const take = () => {
    if (!location.hash) return;
    fragment = location.hash.slice(1);
    history.replaceState(null, "", location.pathname + location.search);
    open();
  };
  addEventListener("hashchange", take);
  take();
  window.explorer.copyLink = (state) =>
    window.explorer.copies(`${location.origin}${location.pathname}#${state}`);
  return (press) => {
    name = press;
    open();
  };
})();
