// Opens files: those that the button of the dialog Designs chooses, and those dropped anywhere on
// the page. viser's own upload would report success before the server has read the file.
window.explorer.files ??= (() => {
  // Most bytes of a file that are sent, with which the server refuses what is too large; bytes of a
  // part.
  const MOST = 32e6,
    PART = 2 ** 19;
  const root = document.documentElement;
  let button = null,
    waiting = [],
    isSending = false,
    count = 0;
  const send = async (file) => {
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
  const open = (files) => {
    waiting.push(...files);
    if (!isSending) window.explorer.sendFile();
  };
  window.explorer.capture("change", (event) => {
    if (event.target.id !== `file_upload_${button}`) return;
    event.stopPropagation();
    open(event.target.files);
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
    open(event.dataTransfer.files);
  });
  // Called with the id of the button on each connection; no file waits from one to the next.
  return (uuid) => {
    button = uuid;
    waiting = [];
    isSending = false;
  };
})();
