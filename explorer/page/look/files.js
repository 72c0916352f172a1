// Sends files: those that buttons choose, and to the button of the dialog Designs those dropped
// anywhere on the page. viser's own upload would report success before the server has read the file.
window.explorer.files ??= (() => {
  // Most bytes of a file that are sent, with which the server refuses what is too large; bytes of a
  // part.
  const MOST = 32e6,
    PART = 2 ** 19;
  const root = document.documentElement;
  const buttons = new Set();
  let ofDrops = null,
    waiting = [],
    isSending = false,
    count = 0;
  const send = async ([file, button]) => {
    // A folder cannot be read.
    const buffer = await file
      .slice(0, MOST)
      .arrayBuffer()
      .catch(() => new ArrayBuffer(0));
    const content = new Uint8Array(buffer);
    const sendMessage = window.__viserMutable.sendMessage;
    const parts = Math.ceil(content.length / PART);
    const ids = {
      source_component_uuid: button,
      transfer_uuid: `${Date.now()}-${Math.random()}-${count++}`,
    };
    sendMessage({
      type: "FileTransferStartUpload",
      ...ids,
      filename: file.name,
      mime_type: file.type,
      size_bytes: content.length,
      part_count: parts,
    });
    for (let part_index = 0; part_index < parts; part_index++) {
      const part = content.slice(part_index * PART, (part_index + 1) * PART);
      sendMessage({ type: "FileTransferPart", ...ids, part_index, content: part });
    }
  };
  // The server takes one file at a time, and asks for the next one.
  window.explorer.sendFile = () => {
    const file = waiting.shift();
    isSending = Boolean(file);
    if (file) send(file);
  };
  const open = (files, button) => {
    for (const file of files) waiting.push([file, button]);
    if (!isSending) window.explorer.sendFile();
  };
  window.explorer.capture("change", (event) => {
    const [, button] = /^file_upload_(.*)/.exec(event.target.id) ?? [];
    if (!buttons.has(button)) return;
    event.stopPropagation();
    open(event.target.files, button);
  });
  const hasFiles = ({ dataTransfer }) => dataTransfer?.types.includes("Files");
  addEventListener("dragover", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    root.dataset.drop = "";
  });
  // The pointer has left the window.
  addEventListener("dragleave", ({ relatedTarget }) => {
    if (!relatedTarget) delete root.dataset.drop;
  });
  addEventListener("drop", (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    delete root.dataset.drop;
    open(event.dataTransfer.files, ofDrops);
  });
  // Called with the id of each button on each connection; no file waits from one to the next.
  return (uuid, takesDrops) => {
    buttons.add(uuid);
    if (takesDrops) ofDrops = uuid;
    waiting = [];
    isSending = false;
  };
})();
