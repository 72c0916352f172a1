// Says since when the explorer does not answer, until it does, and marks the numbers meanwhile: the
// connection is closed, or the explorer is silent and leaves questions of the page unanswered.
window.explorer.connection ??= (() => {
  const { clock, make, send, socket } = window.explorer;
  // Milliseconds between two looks, and the number of looks in a silence after which the page asks,
  // tells, and connects anew, which it does again after as many more.
  const PAUSE = 2500,
    ASK = 2,
    TELL = 5,
    CONNECT = 12;
  const message = make("div", { className: "ex-lost", role: "alert" });
  // Id of the number field of this tab that takes questions, and whether the work is saved.
  let inbox = null,
    isSaved = false;
  let looks = 0,
    questions = 0,
    isClosed = false,
    heard = new Date();
  const show = () => {
    const isLost = isClosed || looks >= TELL;
    document.documentElement.toggleAttribute("data-ex-lost", isLost);
    if (!isLost) message.remove();
    else if (!message.isConnected) {
      const [time] = heard.toTimeString().split(" ");
      const saved = isSaved ? "; your work is saved" : "";
      message.textContent = `The explorer has not answered since ${time}. The page asks again every few seconds${saved}.`;
      document.body.append(message);
    }
  };
  socket.listen(({ type }) => {
    isClosed = type === "closed";
    // The tour has gone with the connection.
    if (isClosed) window.explorer.tour?.end();
    else [looks, heard] = [0, new Date()];
    show();
  });
  const look = () => {
    looks += 1;
    if (looks >= ASK && !isClosed) send(inbox, (questions += 1));
    if (looks % CONNECT === 0) socket.connect();
    show();
    // What has come is heard before the next pause begins.
    setTimeout(() => clock.after(PAUSE, look, true));
  };
  look();
  return (uuid, saved) => {
    [inbox, isSaved] = [uuid, saved];
  };
})();
