// Loads viser's page below the start screen, which says how much of it has come, then of the design,
// and leaves once all is there. The address is that of viser's page, whose size is in bytes; the count
// is that of the messages with the design.
window.explorer.start ??= async (address, size, count) => {
  const { clock, recall, socket } = window.explorer;
  // The share of viser's page in all that comes.
  const SHARE = 0.6;
  const screen = document.querySelector(".ex-start"),
    words = screen.querySelector("[role=status]"),
    bar = screen.querySelector("progress");
  const tell = (text, share = bar.value) => {
    words.textContent = text;
    bar.value = share;
  };
  const fail = (error) =>
    tell(`The page does not start: ${error?.message ?? error}. Load it again.`);
  const systemTheme = () => (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  const choice = recall("theme") ?? "system";
  const theme = () => (choice === "system" ? systemTheme() : choice);
  screen.style.colorScheme = theme();

  const leave = () => {
    const { messageQueue, nodeRefFromName } = window.__viserMutable ?? {};
    // The root of the scene and its axes are there before all others.
    const isBuilt = messageQueue?.length === 0 && Object.keys(nodeRefFromName).length > 2;
    // The explorer answers the theme that the page sends.
    const isThemed = document.documentElement.dataset.mantineColorScheme === theme();
    clock.atFrame(isBuilt && isThemed ? () => screen.remove() : leave);
  };
  let received = 0;
  const listen = ({ type, messages }) => {
    if (type === "connected") received = 0;
    if (type === "closed") tell("The explorer does not answer. The page asks again every second.");
    if (type !== "message_batch") return;
    received += messages.length;
    tell("Loading the design", SHARE + ((1 - SHARE) * received) / count);
    if (messages.some((message) => message.type === "ReplayDoneMessage")) {
      socket.unlisten(listen);
      leave();
    }
  };
  socket.listen(listen);

  try {
    // A proxy may have a path of its own before that of the explorer.
    const folder = location.pathname.replace(/\/(index\.html)?$/, "");
    const response = await fetch(`${folder}/${address}`);
    if (!response.ok) throw new Error(`${response.status} ${response.statusText}`);
    let bytes = 0;
    const counted = new TransformStream({
      transform: (chunk, stream) => {
        bytes += chunk.length;
        tell("Loading the page", (SHARE * bytes) / size);
        stream.enqueue(chunk);
      },
    });
    const text = await new Response(response.body.pipeThrough(counted)).text();
    const [, head] = text.split(/<\/?head>/);
    // Its scripts run, unlike those of `innerHTML`.
    document.head.append(document.createRange().createContextualFragment(head));
  } catch (error) {
    fail(error);
  }
};
