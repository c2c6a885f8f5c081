// Sends chosen or dropped files one after the other; the page itself follows what is on disk.
function studioSend(file, address, progress) {
  return new Promise((resolve) => {
    const request = new XMLHttpRequest();
    request.open("PUT", `${address}?name=${encodeURIComponent(file.name)}`);
    request.upload.onprogress = (event) => progress(event.loaded / Math.max(1, event.total));
    request.onload = () => resolve({ ok: request.status === 200, text: request.responseText });
    request.onerror = () => resolve({ ok: false, text: `${file.name} was not taken: the connection ended.` });
    request.send(file);
  });
}

async function studioSendAll(input, files) {
  const status = document.getElementById(input.dataset.status);
  const limit = Number(input.dataset.limit);
  const told = [];
  let failed = false;
  for (const file of files) {
    let answer = { ok: false, text: `${file.name} is larger than ${limit / 2 ** 20} MiB, the limit for uploads.` };
    if (file.size <= limit)
      answer = await studioSend(file, input.dataset.upload, (share) => {
        status.textContent = `Sending ${file.name}: ${Math.round(100 * share)} %`;
      });
    failed ||= !answer.ok;
    if (!answer.ok || files.length < 4) told.push(answer.text);
  }
  if (files.length >= 4 && !failed) told.push(`${files.length} files were added.`);
  status.textContent = told.join(" ");
  status.classList.toggle("studio-problem", failed);
  input.value = "";
}

document.addEventListener("change", (event) => {
  const input = event.target.closest("input[data-upload]");
  if (input && input.files.length) studioSendAll(input, [...input.files]);
});
for (const kind of ["dragover", "dragleave", "drop"])
  document.addEventListener(kind, (event) => {
    const zone = event.target.closest?.(".studio-drop");
    event.preventDefault();
    document.querySelectorAll(".studio-drop").forEach((each) => {
      each.classList.toggle("studio-over", kind === "dragover" && each === zone);
    });
    if (kind === "drop" && zone) studioSendAll(zone.querySelector("input"), [...event.dataTransfer.files]);
  });
