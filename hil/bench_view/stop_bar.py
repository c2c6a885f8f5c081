"""The stop button on the page: plain HTML before all else, in a frame of another site.

It is part of the page as it comes from the server, so it needs neither the studio's connection nor its scripts. `localhost` and
`127.0.0.1` are different sites, and a browser that isolates sites runs the frame in a process of its own: it works while the
page around it hangs.
"""

from html import escape

from hil.bench_view.watched import Watched

OTHER = {"127.0.0.1": "localhost", "localhost": "127.0.0.1"}

STYLE = """<style>
#bench-stop { position: sticky; top: 0; z-index: 5000; display: flex; align-items: center; gap: 12px; background: #fff;
  border-bottom: 2px solid #7d1a15; min-height: 66px; }
#bench-stop iframe { flex: 1 1 460px; height: 66px; border: 0; display: block; min-width: 0; }
#bench-stop a, #bench-stop p { flex: 0 1 auto; margin: 0; padding: 0 16px; color: #1a1a1a; }
@media (max-width: 900px) { #bench-stop { flex-wrap: wrap; padding-bottom: 6px; } #bench-stop iframe { flex-basis: 100%; } }
</style>"""

# Text of this element changes whenever the page is drawn anew.
SIGN = "bench-sign"

# The frame is told whenever the page has news; without any it says that the page shows old numbers. Escape stops from anywhere on the page, as long as the page itself is alive; in the frame it works always.
_SCRIPT = """<script>
{
  const tell = words => document.querySelector("#bench-stop iframe").contentWindow.postMessage(words, "%s");
  addEventListener("keydown", event => { if (event.key === "Escape") tell("stop"); }, true);
  let last = "";
  setInterval(() => {
    const now = document.getElementById("%s")?.textContent ?? "";
    if (now !== last) { last = now; tell("news"); }
  }, 400);
}
</script>"""

NONE = f'{STYLE}<aside id="bench-stop" aria-label="Stop"><p>No session, nothing to stop.</p></aside>'
NOT_THERE = NONE.replace(
    "No session, nothing to stop.", "No stop button for this session yet: use the pendant, or Ctrl-C in its terminal."
)


def stop_bar(seen: Watched | None, host: str) -> str:
    """HTML of the bar; `host` is the name under which the browser knows the studio."""
    if seen is None or seen.is_over:
        return NONE
    if seen.stop is None or not seen.stop.port:
        return NOT_THERE
    address = seen.stop.address(OTHER.get(host, "localhost"))
    origin = address.removesuffix(f"/{seen.stop.token}/")
    return (
        f'{STYLE}<aside id="bench-stop" aria-label="Stop"><iframe src="{escape(address)}" title="Stop {escape(seen.title)}"></iframe>'
        f"<p>Stops <strong>{escape(seen.title)}</strong></p>"
        f'<a href="{escape(address)}" target="_blank" rel="noopener">Stop button in a window of its own</a></aside>'
        + _SCRIPT
        % (origin, SIGN)
    )
