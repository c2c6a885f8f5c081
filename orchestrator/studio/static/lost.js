// Says what to do when the server does not answer any more, instead of trying to reconnect for ever.
const STUDIO_LOST = {
  gone: "The studio does not answer. Start 'misfit studio' again and open the link that it prints; nothing is lost.",
  other: "The studio was started again. Open the link that it printed; nothing is lost.",
};

// The page reconnects by itself after a short break, and keeps what is open; only a long one needs a reload.
const STUDIO_PATIENCE = 5;
let studioTries = 0;

// The socket tells, and not whether the page's own notice shows: that one waits for a first connection to break.
async function studioAskServer() {
  const popup = document.getElementById("popup");
  if (!popup || window.socket?.connected) {
    studioTries = 0;
    return;
  }
  studioTries += 1;
  let status = 0;
  try {
    status = (await fetch(location.href, { cache: "no-store" })).status;
  } catch {
    status = 0;
  }
  if (window.socket?.connected) return;
  if (status === 200) {
    if (studioTries >= STUDIO_PATIENCE) location.reload();
    return;
  }
  popup.ariaHidden = "false";
  popup.textContent = status === 403 ? STUDIO_LOST.other : STUDIO_LOST.gone;
}

setInterval(studioAskServer, 3000);
