(() => {
  "use strict";

  const TRAIL_S = 6;           // how far back trails reach
  const TRAIL_PARTS = 4;       // each fainter than the next
  const SMALLEST_RADIUS = 5;   // of a disk (pixels), however far away the view is
  const FOLLOW_MARGIN = 6;     // around a followed swarm (robot radii)
  const LONGEST_STEP_S = 0.25; // after a pause of the browser, no leap
  const FULL = 65535;

  const data = JSON.parse(document.getElementById("replay-data").textContent);
  const section = document.getElementById("replay");
  const find = (name) => section.querySelector(name);
  const play = find(".play"), seek = find(".seek"), clock = find(".clock"), speed = find(".speed");
  const follow = find(".follow"), sight = find(".sight");
  const duration = (data.frames - 1) * data.interval;
  const state = { time: 0, playing: false, last: 0 };
  let colors = {};

  function decode(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Uint16Array.from({ length: bytes.length / 2 }, (_, k) => view.getUint16(2 * k, true));
  }

  const canvases = section.querySelectorAll("canvas");
  const swarms = data.swarms.map((swarm, k) => ({
    ...swarm, poses: decode(swarm.poses), canvas: canvases[k], pen: canvases[k].getContext("2d"),
  }));

  // One body's pose [x, y, heading] at a frame that may lie between two stored ones.
  function pose(swarm, frame, body) {
    const [left, bottom, right, top] = data.view;
    const before = Math.min(Math.floor(frame), data.frames - 1), after = Math.min(before + 1, data.frames - 1);
    const part = frame - before;
    const a = 3 * (before * swarm.bodies + body), b = 3 * (after * swarm.bodies + body);
    const mix = (k) => (swarm.poses[a + k] + part * (swarm.poses[b + k] - swarm.poses[a + k])) / FULL;
    let turn = (swarm.poses[b + 2] - swarm.poses[a + 2]) / FULL;
    turn -= Math.round(turn);
    const heading = 2 * Math.PI * (swarm.poses[a + 2] / FULL + part * turn);
    return [left + mix(0) * (right - left), bottom + mix(1) * (top - bottom), heading];
  }

  const posesAt = (swarm, frame) => Array.from({ length: swarm.bodies }, (_, body) => pose(swarm, frame, body));
  const items = data.items.flatMap((item) => Array(item.count).fill(item));  // the last bodies
  const itemOf = (swarm, body) => items[body - (swarm.bodies - items.length)];
  const otherRadius = (swarm, body) => itemOf(swarm, body)?.radius ?? data.objectRadius;
  const radius = (swarm, body) => (body < swarm.robots ? data.robotRadius : otherRadius(swarm, body));

  // The part of the plane that every canvas shows: all that ever happens, or what there is at the moment.
  function shownView(scenes) {
    if (!follow.checked) return data.view;
    const points = scenes.flat(), margin = FOLLOW_MARGIN * data.robotRadius;
    const xs = points.map((p) => p[0]), ys = points.map((p) => p[1]);
    const left = Math.min(...xs), right = Math.max(...xs), bottom = Math.min(...ys), top = Math.max(...ys);
    const aspect = (data.view[2] - data.view[0]) / (data.view[3] - data.view[1]);
    const width = Math.max(right - left + 2 * margin, (top - bottom + 2 * margin) * aspect), height = width / aspect;
    const x = (left + right) / 2, y = (bottom + top) / 2;
    return [x - width / 2, y - height / 2, x + width / 2, y + height / 2];
  }

  function readColors() {
    const style = getComputedStyle(document.documentElement);
    const names = ["ink", "muted", "rule", "blue", "orange", "green", "amber", "purple", "sky", "heading"];
    colors = Object.fromEntries(names.map((name) => [name, style.getPropertyValue("--" + name).trim()]));
  }

  function fit(canvas) {
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    return ratio;
  }

  function draw() {
    const frame = state.time / data.interval;
    const scenes = swarms.map((swarm) => posesAt(swarm, frame));
    const view = shownView(scenes);
    swarms.forEach((swarm, k) => drawSwarm(swarm, scenes[k], view, frame));
  }

  function drawSwarm(swarm, poses, view, frame) {
    const { pen, canvas } = swarm;
    const ratio = fit(canvas), scale = canvas.width / (view[2] - view[0]);
    const onCanvas = ([x, y]) => [(x - view[0]) * scale, canvas.height - (y - view[1]) * scale];
    pen.clearRect(0, 0, canvas.width, canvas.height);
    drawWalls(pen, onCanvas, ratio);
    drawTrails(swarm, onCanvas, frame, ratio);
    if (sight.checked) drawSight(swarm, poses, onCanvas, view, ratio);
    poses.forEach((body, k) => {
      const size = Math.max(radius(swarm, k) * scale, SMALLEST_RADIUS * ratio);
      if (k >= swarm.robots) drawObject(pen, onCanvas(body), size, colors[itemOf(swarm, k)?.color ?? "green"]);
      else drawRobot(pen, onCanvas(body), body[2], size, swarm.replicas[k]);
    });
    drawScaleBar(pen, canvas, view, scale, ratio);
  }

  function disk(pen, [x, y], size) {
    pen.beginPath();
    pen.arc(x, y, size, 0, 2 * Math.PI);
  }

  function drawObject(pen, center, size, color) {
    pen.globalAlpha = 0.75;
    pen.fillStyle = color;
    disk(pen, center, size);
    pen.fill();
    pen.globalAlpha = 1;
  }

  function drawRobot(pen, center, heading, size, replica) {
    const [x, y] = center, rim = 0.26 * size;
    if (replica) {
      pen.globalAlpha = 0.3;
      pen.fillStyle = colors.orange;
      disk(pen, center, size);
      pen.fill();
      pen.globalAlpha = 1;
      pen.strokeStyle = colors.orange;
      pen.lineWidth = rim;
      disk(pen, center, size - rim / 2);
      pen.stroke();
    } else {
      pen.fillStyle = colors.blue;
      disk(pen, center, size);
      pen.fill();
    }
    pen.strokeStyle = replica ? colors.ink : colors.heading;
    pen.lineWidth = Math.max(0.24 * size, 1);
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + size * Math.cos(heading), y - size * Math.sin(heading));
    pen.stroke();
  }

  function drawWalls(pen, onCanvas, ratio) {
    if (!data.walls) return;
    const [x, y] = onCanvas(data.walls), [right, top] = onCanvas(data.walls.slice(2));
    pen.strokeStyle = colors.muted;
    pen.lineWidth = ratio;
    pen.strokeRect(x, top, right - x, y - top);
  }

  function drawTrails(swarm, onCanvas, frame, ratio) {
    const frames = TRAIL_S / data.interval, step = Math.max(frames / (8 * TRAIL_PARTS), 1);
    swarm.pen.lineWidth = ratio;
    for (let part = 0; part < TRAIL_PARTS; part++) {
      const start = Math.max(0, frame - frames * (1 - part / TRAIL_PARTS));
      const stop = Math.max(0, frame - frames * (1 - (part + 1) / TRAIL_PARTS));
      swarm.pen.globalAlpha = (0.5 * (part + 1)) / TRAIL_PARTS;
      for (let k = 0; k < swarm.robots && stop > start; k++) drawTrail(swarm, k, onCanvas, [start, stop, step]);
    }
    swarm.pen.globalAlpha = 1;
  }

  function drawTrail(swarm, robot, onCanvas, [start, stop, step]) {
    swarm.pen.strokeStyle = swarm.replicas[robot] ? colors.orange : colors.blue;
    swarm.pen.beginPath();
    for (let at = start; at < stop; at += step) swarm.pen.lineTo(...onCanvas(pose(swarm, at, robot)));
    swarm.pen.lineTo(...onCanvas(pose(swarm, stop, robot)));
    swarm.pen.stroke();
  }

  // The distance from a robot's center to the first disk that its line of sight meets; infinite if there is none.
  function sightDistance(swarm, poses, robot) {
    const [x, y, heading] = poses[robot], ahead = [Math.cos(heading), Math.sin(heading)];
    let nearest = Infinity;
    poses.forEach((other, k) => {
      if (k === robot || itemOf(swarm, k)?.visible === false) return;
      const dx = other[0] - x, dy = other[1] - y;
      const along = dx * ahead[0] + dy * ahead[1], across = dx * ahead[1] - dy * ahead[0];
      const rest = radius(swarm, k) ** 2 - across ** 2;
      if (along > 0 && rest >= 0) nearest = Math.min(nearest, along - Math.sqrt(rest));
    });
    return nearest;
  }

  function drawSight(swarm, poses, onCanvas, view, ratio) {
    const far = 2 * (view[2] - view[0] + view[3] - view[1]);
    for (let k = 0; k < swarm.robots; k++) {
      const [x, y, heading] = poses[k], distance = sightDistance(swarm, poses, k), seen = distance < Infinity;
      const reach = seen ? distance : far;
      swarm.pen.globalAlpha = seen ? 0.8 : 0.25;
      swarm.pen.setLineDash(seen ? [] : [2 * ratio, 4 * ratio]);
      swarm.pen.strokeStyle = colors.muted;
      swarm.pen.lineWidth = ratio;
      swarm.pen.beginPath();
      swarm.pen.moveTo(...onCanvas([x, y]));
      swarm.pen.lineTo(...onCanvas([x + reach * Math.cos(heading), y + reach * Math.sin(heading)]));
      swarm.pen.stroke();
    }
    swarm.pen.setLineDash([]);
    swarm.pen.globalAlpha = 1;
  }

  function drawScaleBar(pen, canvas, view, scale, ratio) {
    const aim = (view[2] - view[0]) / 4, power = 10 ** Math.floor(Math.log10(aim));
    const length = power * [5, 2, 1].find((step) => step * power <= aim);
    const x = 12 * ratio, y = canvas.height - 8 * ratio;
    pen.fillStyle = pen.strokeStyle = colors.muted;
    pen.lineWidth = 1.5 * ratio;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + length * scale, y);
    pen.stroke();
    pen.font = `${12 * ratio}px system-ui, sans-serif`;
    pen.textBaseline = "middle";
    pen.fillText(length >= 100 ? `${length / 100} m` : `${length} cm`, x + length * scale + 6 * ratio, y);
  }

  function show() {
    const text = `${state.time.toFixed(1)} s of ${duration.toFixed(1)} s`;
    seek.value = state.time;
    seek.setAttribute("aria-valuetext", text);
    clock.textContent = text;
    section.dataset.playing = state.playing;
    section.dataset.time = state.time;
    find(".word").textContent = state.playing ? "Pause" : "Play";
    draw();
  }

  function advance(now) {
    if (!state.playing) return;
    const step = Math.min((now - state.last) / 1000, LONGEST_STEP_S);
    state.last = now;
    state.time = Math.min(state.time + Math.max(step, 0) * Number(speed.value), duration);
    state.playing = state.time < duration;
    show();
    if (state.playing) requestAnimationFrame(advance);
  }

  function toggle() {
    if (duration === 0) return;
    state.playing = !state.playing;
    if (state.playing) {
      if (state.time >= duration) state.time = 0;
      state.last = performance.now();
      requestAnimationFrame(advance);
    }
    show();
  }

  function go(time) {
    state.time = Math.min(Math.max(time, 0), duration);
    show();
  }

  function onKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.closest("input, select, summary, [tabindex]")) return;
    if (event.key === " " && event.repeat) return;
    if (event.key === " " && !event.target.closest("button")) toggle();
    else if (event.key === "ArrowLeft") go(state.time - data.interval);
    else if (event.key === "ArrowRight") go(state.time + data.interval);
    else return;
    event.preventDefault();
  }

  function watchResolution() {  // of the screen, or by another zoom; it may change after the size
    const changed = () => { draw(); watchResolution(); };
    matchMedia(`(resolution: ${window.devicePixelRatio}dppx)`).addEventListener("change", changed, { once: true });
  }

  function start() {
    const [left, bottom, right, top] = data.view;
    canvases.forEach((canvas) => { canvas.style.aspectRatio = `${right - left} / ${top - bottom}`; });
    seek.max = duration;
    play.disabled = seek.disabled = duration === 0;
    play.addEventListener("click", toggle);
    seek.addEventListener("input", () => go(Number(seek.value)));
    follow.addEventListener("change", draw);
    sight.addEventListener("change", draw);
    document.addEventListener("keydown", onKey);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readColors(); draw(); });
    const observer = new ResizeObserver(draw);
    canvases.forEach((canvas) => observer.observe(canvas));
    addEventListener("resize", draw);
    watchResolution();
    readColors();
    show();
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) toggle();
  }

  start();
})();
