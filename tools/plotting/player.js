// Plays the JSON of the element #run on two canvases: the arm in perspective, and the error of its tip.
"use strict";
(() => {
  const run = JSON.parse(document.getElementById("run").textContent);
  const colours = {"reference": "#2ca02c", "true arm": "#1b2733", "estimate": "#1f77b4"};
  const unpack = text => new Int16Array(Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const lines = run.lines.map(line => ({name: line.name, points: unpack(line.points)}));
  const perFrame = 3 * run.perLine, frames = run.t.length, last = lines[lines.length - 1];
  const arm = document.getElementById("arm"), error = document.getElementById("error");
  const slider = document.getElementById("time"), button = document.getElementById("play");
  const speed = document.getElementById("speed");

  // The middle and size of all that is ever shown.
  const low = [1e9, 1e9, 1e9], high = [-1e9, -1e9, -1e9];
  for (const {points} of lines) {
    for (let i = 0; i < points.length; ++i) {
      if (points[i] === -32768) continue;
      low[i % 3] = Math.min(low[i % 3], points[i]);
      high[i % 3] = Math.max(high[i % 3], points[i]);
    }
  }
  const middle = low.map((v, k) => (v + high[k]) / 2);
  const size = Math.max(...low.map((v, k) => high[k] - v), 1);
  const view = {turn: 0.9, rise: 0.35, zoom: 1};

  function project(x, y, z) {
    const a = x - middle[0], b = y - middle[1], c = z - middle[2];
    const right = a * Math.cos(view.turn) - b * Math.sin(view.turn);
    const away = a * Math.sin(view.turn) + b * Math.cos(view.turn);
    const up = c * Math.cos(view.rise) - away * Math.sin(view.rise);
    const depth = 3 * size + away * Math.cos(view.rise) + c * Math.sin(view.rise);
    const scale = view.zoom * 2.2 * arm.height / depth;
    return [arm.width / 2 + right * scale, arm.height / 2 - up * scale];
  }

  // Point k of a line between two frames; null where it is not known.
  function at(points, frame, share, k) {
    const i = frame * perFrame + 3 * k, j = Math.min(frame + 1, frames - 1) * perFrame + 3 * k;
    if (points[i] === -32768 || points[j] === -32768) return null;
    return [0, 1, 2].map(e => points[i + e] + share * (points[j + e] - points[i + e]));
  }

  function polyline(context, points) {
    context.beginPath();
    let drawing = false;
    for (const point of points) {
      if (!point) { drawing = false; continue; }
      const [x, y] = project(...point);
      if (drawing) context.lineTo(x, y); else context.moveTo(x, y);
      drawing = true;
    }
    context.stroke();
  }

  function drawArm(frame, share, time) {
    const c = arm.getContext("2d");
    c.clearRect(0, 0, arm.width, arm.height);
    c.lineCap = c.lineJoin = "round";
    c.setLineDash([]);
    c.strokeStyle = "#dde3e8";
    c.lineWidth = 1;
    const floor = low[2] - 0.05 * size, step = size / 5;
    for (let k = -4; k <= 4; ++k) {
      const x = middle[0] + k * step, y = middle[1] + k * step;
      polyline(c, [[x, middle[1] - 4 * step, floor], [x, middle[1] + 4 * step, floor]]);
      polyline(c, [[middle[0] - 4 * step, y, floor], [middle[0] + 4 * step, y, floor]]);
    }
    c.strokeStyle = "#e07b39";
    const trail = [];
    for (let k = Math.max(0, frame - 60); k <= frame; ++k) trail.push(at(last.points, k, 0, run.perLine - 1));
    polyline(c, trail);
    for (const {name, points} of [...lines].reverse()) {
      c.strokeStyle = colours[name];
      c.lineWidth = name === "estimate" ? 7 : 2.5;
      c.setLineDash(name === "reference" ? [8, 7] : []);
      c.globalAlpha = name === "estimate" ? 0.75 : 1;
      const line = [];
      for (let k = 0; k < run.perLine; ++k) line.push(at(points, frame, share, k));
      polyline(c, line);
    }
    c.globalAlpha = 1;
    c.setLineDash([]);
    c.font = "15px system-ui, sans-serif";
    c.fillStyle = "#1b2733";
    const tip = run.tipError && run.tipError[frame] !== null ? `   tip error ${run.tipError[frame].toFixed(2)} mm` : "";
    c.fillText(`${time.toFixed(2)} s   ${run.mode[frame]}${tip}`, 12, 22);
    lines.forEach(({name}, k) => { c.fillStyle = colours[name]; c.fillText(name, 12, 46 + 20 * k); });
    const top = Math.max(1e-9, ...run.pressures.flat(2).filter(v => v !== null));
    run.pressures.forEach((segment, i) => segment[frame].forEach((value, k) => {
      const x = arm.width - 60 * segment[frame].length + 60 * k, y = 8 + 26 * i;
      const share = Math.max(0, (value ?? 0) / top);
      c.fillStyle = `rgb(${70 + 150 * share}, ${110 - 50 * share}, ${200 - 160 * share})`;
      c.fillRect(x, y, 56, 22);
      c.fillStyle = "white";
      c.fillText(value === null ? "–" : value.toFixed(2), x + 12, y + 16);
    }));
    if (run.pressures.length) {
      c.fillStyle = "#5b6770";
      c.fillText(`chambers in ${run.unit}, base first`, arm.width - 200, 26 + 26 * run.pressures.length);
    }
  }

  function drawError(time) {
    const c = error.getContext("2d"), left = 60, bottom = error.height - 24;
    c.clearRect(0, 0, error.width, error.height);
    c.font = "13px system-ui, sans-serif";
    c.fillStyle = "#5b6770";
    const known = (run.tipError ?? []).filter(v => v !== null);
    if (!known.length) { c.fillText("no reference for the tip in this run", left, bottom / 2); return; }
    const begin = run.t[0], end = run.t[frames - 1], most = Math.max(...known, 1e-6);
    const x = t => left + (t - begin) / (end - begin) * (error.width - left - 10);
    const y = v => bottom - v / most * (bottom - 14);
    c.fillText(`${most.toPrecision(3)} mm`, 2, 18);
    c.fillText("0", 40, bottom);
    c.fillText(`${begin.toFixed(1)} s`, left, error.height - 6);
    c.fillText(`${end.toFixed(1)} s`, error.width - 50, error.height - 6);
    c.strokeStyle = "#c3ccd4";
    c.strokeRect(left, 14, error.width - left - 10, bottom - 14);
    c.strokeStyle = "#1f77b4";
    c.beginPath();
    let drawing = false;
    run.tipError.forEach((value, k) => {
      if (value === null) { drawing = false; return; }
      if (drawing) c.lineTo(x(run.t[k]), y(value)); else c.moveTo(x(run.t[k]), y(value));
      drawing = true;
    });
    c.stroke();
    c.strokeStyle = "#e07b39";
    c.beginPath();
    c.moveTo(x(time), 14);
    c.lineTo(x(time), bottom);
    c.stroke();
  }

  const state = {time: run.t[0], playing: true, before: null, frame: 0, tip: null};
  window.softarmPlayer = state;  // for tests: the time shown and where the tip is, in m

  function show() {
    while (state.frame + 1 < frames && run.t[state.frame + 1] <= state.time) ++state.frame;
    while (state.frame > 0 && run.t[state.frame] > state.time) --state.frame;
    const next = Math.min(state.frame + 1, frames - 1);
    const step = run.t[next] - run.t[state.frame];
    const share = step > 0 ? (state.time - run.t[state.frame]) / step : 0;
    const tip = at(last.points, state.frame, share, run.perLine - 1);
    state.tip = tip && tip.map(v => v * run.scale);
    drawArm(state.frame, share, state.time);
    drawError(state.time);
  }

  function tick(now) {
    if (state.playing && state.before !== null) {
      state.time += 1e-3 * (now - state.before) * Number(speed.value);
      if (state.time >= run.t[frames - 1]) state.time = run.t[0];
      slider.value = (state.time - run.t[0]) / (run.t[frames - 1] - run.t[0]);
      show();
    }
    state.before = now;
    requestAnimationFrame(tick);
  }

  button.onclick = () => {
    state.playing = !state.playing;
    button.textContent = state.playing ? "pause" : "play";
  };
  slider.oninput = () => {
    state.time = run.t[0] + Number(slider.value) * (run.t[frames - 1] - run.t[0]);
    show();
  };
  arm.onpointermove = event => {
    if (!event.buttons) return;
    view.turn += 0.008 * event.movementX;
    view.rise = Math.max(-1.5, Math.min(1.5, view.rise + 0.008 * event.movementY));
    show();
  };
  arm.onwheel = event => {
    event.preventDefault();
    view.zoom *= Math.exp(-0.001 * event.deltaY);
    show();
  };
  show();
  requestAnimationFrame(tick);
})();
