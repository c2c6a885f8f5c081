"""The page of the stop button: one button, and a line that says whether it works. It needs nothing but its own server."""

from string import Template

# A page around the button that has had no news for so long shows old numbers (ms).
OLD_MS = 2500
# The button's own script asks so often whether its server and the loop live, and waits so long for the answer (ms).
ASK_MS, PATIENCE_MS = 250, 600

_PAGE = Template("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Stop the robot</title>
<meta name="viewport" content="width=device-width">
<style nonce="$nonce">
body { margin: 0; font: 16px system-ui, sans-serif; background: #fff; color: #1a1a1a; }
main { display: flex; align-items: center; gap: 16px; height: 64px; padding: 0 8px; }
form { margin: 0; flex: none; }
button { height: 52px; padding: 0 28px; font: bold 20px system-ui, sans-serif; color: #fff; background: #b3261e;
  border: 3px solid #7d1a15; border-radius: 6px; cursor: pointer; }
button:hover, button:active { background: #8c1d18; }
button:focus-visible { outline: 4px solid #0072b2; outline-offset: 1px; }
h1 { position: absolute; left: -999px; }
p { margin: 0; line-height: 1.25; }
@media (max-width: 700px) { main { gap: 10px; } button { padding: 0 14px; } p { font-size: 11px; line-height: 1.15; } }
.over button { background: #595959; border-color: #404040; }
.bad { font-weight: bold; color: #a3190f; }
</style></head>
<body><main><h1>Stop the robot</h1>
<form method="post" action="stop"><button id="stop" aria-keyshortcuts="Escape">STOP (Esc)</button></form>
<p id="told" role="status">$words</p>
</main>
<script nonce="$nonce">
const told = document.getElementById("told");
const dead = "This button is DEAD: it does not reach the session. Use the pendant, or Ctrl-C in the session's terminal.";
const old = "The page around this button hangs: it shows OLD numbers. The button works.";
let over = false, news = performance.now();
function say(words, bad) {
  if (told.textContent !== words) { told.textContent = words; told.className = bad ? "bad" : ""; }
}
function stop() {
  if (over) return;
  say("Stopping ...", false);
  fetch("stop", {method: "POST", redirect: "manual", keepalive: true}).catch(() => say(dead, true));
}
async function ask() {
  const patience = new AbortController(), clock = setTimeout(() => patience.abort(), $patience);
  try {
    const answer = await (await fetch("state", {signal: patience.signal})).json();
    over = answer.over;
    document.body.className = over ? "over" : "";
    const aged = parent !== window && performance.now() - news > $old;
    if (aged && answer.ready) say(old, true); else say(answer.words, answer.bad);
  } catch { if (!over) say(dead, true); }
  clearTimeout(clock);
  if (!over) setTimeout(ask, $ask);
}
document.getElementById("stop").addEventListener("pointerdown", stop);
document.querySelector("form").addEventListener("submit", event => { event.preventDefault(); stop(); });
addEventListener("keydown", event => { if (event.key === "Escape") stop(); });
addEventListener("message", event => {
  if (event.source !== parent) return;
  if (event.data === "stop") stop();
  if (event.data === "news") news = performance.now();
});
ask();
</script></body></html>
""")

READY = "Stops the arm gently, also when the page hangs."


def page(nonce: str, words: str) -> bytes:
    """The page; `nonce` allows its script and style and no others."""
    return _PAGE.substitute(nonce=nonce, words=words, ask=ASK_MS, patience=PATIENCE_MS, old=OLD_MS).encode()
