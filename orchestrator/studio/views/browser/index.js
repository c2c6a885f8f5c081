// What the plots share: a selection dragged over a canvas with mouse, pen or finger.

// Calls `done` with the corners in pixels of the canvas, as [x, y] twice; `band` is the element that shows the drag.
// `wanted(event)` tells whether a drag selects; others are left to the chart.
export function selectByDragging(canvas, band, upright, wanted, done) {
  const stop = (event) => wanted(event) && event.stopPropagation();
  for (const kind of ["mousedown", "touchstart"]) canvas.addEventListener(kind, stop, true);
  canvas.addEventListener(
    "pointerdown",
    (begin) => {
      if (!wanted(begin) || begin.button !== 0) return;
      begin.stopPropagation();
      const frame = canvas.getBoundingClientRect();
      const at = (event) => [event.clientX - frame.left, event.clientY - frame.top];
      const show = (event) => stretch(band, at(begin), at(event), upright);
      const end = (event) => {
        window.removeEventListener("pointermove", show);
        band.style.display = "none";
        const far = Math.hypot(event.clientX - begin.clientX, event.clientY - begin.clientY) > 3;
        if (event.type === "pointerup" && far) done(at(begin), at(event));
      };
      window.addEventListener("pointermove", show);
      for (const kind of ["pointerup", "pointercancel"]) window.addEventListener(kind, end, { once: true });
    },
    true,
  );
}

function stretch(band, one, other, upright) {
  const [left, top] = [0, 1].map((k) => `${Math.min(one[k], other[k])}px`);
  const [width, height] = [0, 1].map((k) => `${Math.abs(one[k] - other[k])}px`);
  Object.assign(band.style, { display: "block", left, width }, upright ? { top, height, bottom: "auto" } : {});
}
