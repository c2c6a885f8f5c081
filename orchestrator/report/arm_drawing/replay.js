// The arm in motion: the same geometry as shape.py, arrows.py and svg.py, from the numbers in `data-replay`.
(() => {
  "use strict";
  const Z90 = 1.645;
  const at = ([x, y]) => `${(1000 * x).toFixed(1)} ${(-1000 * y).toFixed(1)}`;
  const round = ([x, y], angle, r) => [x + r * Math.cos(angle), y + r * Math.sin(angle)];
  const clamp = (x, most) => Math.max(-most, Math.min(most, x));

  function joints(length, q) {
    const elbow = round([0, 0], q[0], length[0]);
    return [[0, 0], elbow, round(elbow, q[0] + q[1], length[1])];
  }

  function corner(joint, before, after, arm) {
    const bend = Math.atan2(Math.sin(after - before), Math.cos(after - before));
    const normals = [before, after].map((a) => [-Math.sin(a), Math.cos(a)]);
    if (arm * bend > 0) {
      const share = arm / (1 + Math.cos(clamp(bend, 2.8)));
      return `L${at([0, 1].map((k) => joint[k] + share * (normals[0][k] + normals[1][k])))}`;
    }
    const [enter, leave] = normals.map((n) => [0, 1].map((k) => joint[k] + arm * n[k]));
    const r = (1000 * Math.abs(arm)).toFixed(1);
    return `L${at(enter)} A${r} ${r} 0 0 ${bend > 0 ? 0 : 1} ${at(leave)}`;
  }

  function string(knots, trunk, places, directions) {
    const starts = [[-trunk, 0], places[0], places[1]];
    const parts = knots.map((knot) => {
      if (knot.length === 2) return corner(places[knot[0]], directions[knot[0]], directions[knot[0] + 1], knot[1]);
      const [bone, along, distance] = knot;
      const c = Math.cos(directions[bone]), s = Math.sin(directions[bone]);
      return `L${at([starts[bone][0] + along * c - distance * s, starts[bone][1] + along * s + distance * c])}`;
    });
    return parts.join(" ").replace("L", "M");
  }

  function arc(centre, begin, end, radius) {
    const r = (1000 * radius).toFixed(1), large = Math.abs(end - begin) > Math.PI ? 1 : 0;
    return `M${at(round(centre, begin, radius))} A${r} ${r} 0 ${large} ${end < begin ? 1 : 0} ${at(round(centre, end, radius))}`;
  }

  function torqueArrow(centre, direction, torque, data) {
    const [most, , radius, size] = data.limits, sweep = clamp(torque * data.turn, most);
    if (Math.abs(sweep) * radius < 1e-3) return "";
    const end = direction + sweep, head = Math.min(size / radius, Math.abs(sweep)) * Math.sign(sweep);
    const wings = [1, -1].map((side) => round(centre, end - head, radius + side * 0.6 * Math.abs(head) * radius));
    return `${arc(centre, direction, end, radius)} M${at(wings[0])} L${at(round(centre, end, radius))} L${at(wings[1])}`;
  }

  function forceArrow(start, force, data) {
    const [, most, , size] = data.limits, total = Math.hypot(...force), reach = Math.min(most, total * data.reach);
    if (reach < 1e-3) return "";
    const [x, y] = force.map((f) => f / total), tip = [start[0] + reach * x, start[1] + reach * y];
    const head = Math.min(size, reach), neck = [tip[0] - head * x, tip[1] - head * y];
    const wings = [1, -1].map((side) => at([neck[0] - side * 0.6 * head * y, neck[1] + side * 0.6 * head * x]));
    return `M${at(start)} L${at(tip)} M${wings[0]} L${at(tip)} L${wings[1]}`;
  }

  function set(elements, paths) {
    elements.forEach((element, k) => element.setAttribute("d", paths[k % paths.length]));
  }

  // Draws one instant {q, torque, torque_std, force, activation, modelled} into an `svg.arm`; `data` as in `data-replay`.
  function draw(svg, data, now) {
    const all = (name) => svg.querySelectorAll(`.${name}`), places = joints(data.length, now.q);
    const directions = [0, now.q[0], now.q[0] + now.q[1]];
    const line = (points) => `M${points.map(at).join(" L")}`;
    set(all("link"), [line(places.slice(0, 2)), line(places.slice(1))]);
    all("joint").forEach((circle, k) => {
      circle.setAttribute("cx", (1000 * places[k][0]).toFixed(1));
      circle.setAttribute("cy", (-1000 * places[k][1]).toFixed(1));
    });
    set(all("muscle"), data.strings.map((knots) => string(knots, data.trunk, places, directions)));
    if (now.activation) all("muscle").forEach((path, k) => {
      const active = Math.max(0, Math.min(1, now.activation[k]));
      path.setAttribute("stroke-width", (4 + 14 * active).toFixed(1));
      path.setAttribute("opacity", (0.35 + 0.65 * active).toFixed(2));
    });
    set(all("ghost"), [now.modelled ? line(joints(data.length, now.modelled)) : ""]);
    const torque = now.torque || [0, 0], half = (now.torque_std || [0, 0]).map((s) => Z90 * s * data.turn);
    set(all("torque"), [0, 1].map((k) => torqueArrow(places[k], directions[k + 1], torque[k], data)));
    set(all("spread"), [0, 1].map((k) => {
      const end = directions[k + 1] + torque[k] * data.turn;
      return half[k] ? arc(places[k], end - half[k], end + half[k], data.limits[2]) : "";
    }));
    set(all("force"), [now.force ? forceArrow(places[2], now.force, data) : ""]);
  }

  const SERIES = ["q", "torque", "torque_std", "force", "activation", "modelled"];

  function instant(data, time) {
    const last = data.time.length - 1;
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (data.time[middle] <= time) low = middle; else high = middle;
    }
    const share = last ? Math.max(0, Math.min(1, (time - data.time[low]) / (data.time[high] - data.time[low]))) : 0;
    const now = { time };
    for (const name of SERIES) {
      if (data[name]) now[name] = data[name][low].map((x, k) => x + share * (data[name][high][k] - x));
    }
    return now;
  }

  function words(now) {
    const number = (x, digits) => x.toFixed(digits).replace("-", "−");
    const parts = [`shoulder ${number(now.q[0], 3)} rad, elbow ${number(now.q[1], 3)} rad`];
    if (now.torque) {
      const within = (k) => (now.torque_std ? ` ± ${number(Z90 * now.torque_std[k], 3)}` : "");
      const spread = now.torque_std ? " (90 %)" : "";
      parts.push(`residual torque: shoulder ${number(now.torque[0], 3)}${within(0)} N.m, elbow ${number(now.torque[1], 3)}${within(1)} N.m${spread}`);
    }
    if (now.force) parts.push(`force at the wrist ${number(Math.hypot(...now.force), 2)} N`);
    return `${parts.join("; ")}.`;
  }

  function mount(root) {
    if (root.misfitMounted) return;
    root.misfitMounted = true;
    const data = JSON.parse(root.dataset.replay), svg = root.querySelector("svg.arm");
    const curves = root.querySelector("svg.curves"), marks = root.querySelectorAll(".now");
    const [button, slider, clock, readout] = ["button", "input", "output", ".readout"].map((s) => root.querySelector(s));
    const begin = data.time[0], end = data.time[data.time.length - 1];
    // Whoever wants less motion sees two pictures a second instead of a film.
    const calm = matchMedia("(prefers-reduced-motion: reduce)");
    let playing = false, before = 0, shown = 0, time = Number(slider.value);

    function show(t) {
      time = Math.max(begin, Math.min(end, t));
      const now = instant(data, time);
      draw(svg, data, now);
      slider.value = time;
      slider.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
      clock.textContent = `${time.toFixed(2)} s`;
      readout.textContent = words(now);
      if (curves) {
        const [left, right] = [Number(curves.dataset.left), Number(curves.dataset.right)];
        const x = left + (right - left) * (time - begin) / (end - begin || 1);
        marks.forEach((mark) => { mark.setAttribute("x1", x); mark.setAttribute("x2", x); });
      }
    }

    function tick(stamp) {
      if (!playing || !root.isConnected) return;
      const next = time + (before ? (stamp - before) / 1000 : 0);
      before = stamp;
      if (!calm.matches || stamp - shown > 500) { show(next); shown = stamp; } else time = next;
      if (time >= end) { show(end); play(false); } else requestAnimationFrame(tick);
    }

    function play(on) {
      playing = on;
      button.textContent = on ? "Pause" : "Play";
      button.setAttribute("aria-label", on ? "Pause" : "Play");
      if (on) { before = 0; if (time >= end) time = begin; requestAnimationFrame(tick); }
    }

    button.addEventListener("click", () => play(!playing));
    slider.addEventListener("input", () => { play(false); show(Number(slider.value)); });
    slider.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
      if (event.key === " ") play(!playing);
      else if (step) { play(false); show(time + step * (end - begin) / 100); } else return;
      event.preventDefault();
    });
    if (curves) curves.addEventListener("click", (event) => {
      const box = curves.getBoundingClientRect(), scale = curves.viewBox.baseVal.width / box.width;
      const [left, right] = [Number(curves.dataset.left), Number(curves.dataset.right)];
      play(false);
      show(begin + (end - begin) * ((event.clientX - box.left) * scale - left) / (right - left));
    });
    root.querySelector(".controls").hidden = false; // where no script runs, there are none
    root.misfitShow = show;
    show(time);
  }

  window.misfitArm = { draw, mount };
  const all = () => document.querySelectorAll(".arm-replay").forEach(mount);
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", all); else all();
})();
