(() => {
  "use strict";

  const TRAIL_S = 1.5;          // how far back trails reach, as they are seen
  const TRAIL_PARTS = 4;        // each fainter than the next
  const RADIUS = 0.014;         // of a disk, as a share of the view
  const SMALLEST_RADIUS = 3;    // (pixels)
  const LONGEST_STEP_S = 0.25;  // after a pause of the browser, no leap
  const FASTEST_S = 0.3;        // of an answer: the second half of a double click is none
  const FULL = 65535;

  const data = JSON.parse(document.getElementById("replay-data").textContent);
  const section = document.getElementById("game"), score = document.getElementById("score");
  const find = (name) => section.querySelector(name);
  const choices = [...section.querySelectorAll(".choice")];
  const canvases = choices.map((choice) => choice.querySelector("canvas"));
  const duration = (data.frames - 1) * data.interval;
  const state = { pair: 0, time: 0, playing: false, last: 0, begun: performance.now(), scenes: [] };
  const answers = [];

  function decode(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Uint16Array.from({ length: bytes.length / 2 }, (_, k) => view.getUint16(2 * k, true));
  }

  // On which side the real motion of a pair is: left if its mark has an even number of ones.
  function realSide(pair) {
    let ones = 0;
    for (let rest = pair.mark; rest > 0; rest = Math.floor(rest / 2)) ones += rest % 2;
    return ones % 2 === 0 ? "left" : "right";
  }

  // A body's place at a frame that may lie between two stored ones, as shares of the view.
  function place(scene, frame, body) {
    const before = Math.min(Math.floor(frame), data.frames - 1), after = Math.min(before + 1, data.frames - 1);
    const a = 2 * (before * data.bodies + body), b = 2 * (after * data.bodies + body), part = frame - before;
    return [0, 1].map((k) => (scene[a + k] + part * (scene[b + k] - scene[a + k])) / FULL);
  }

  function drawScene(canvas, scene) {
    const ratio = window.devicePixelRatio || 1, size = Math.round(canvas.clientWidth * ratio);
    if (canvas.width !== size) canvas.width = canvas.height = size;
    const pen = canvas.getContext("2d"), frame = state.time / data.interval;
    const onCanvas = ([x, y]) => [x * size, (1 - y) * size];
    const reach = (TRAIL_S * data.speed) / data.interval;
    const color = getComputedStyle(document.documentElement).getPropertyValue("--blue").trim();
    pen.clearRect(0, 0, size, size);
    pen.strokeStyle = pen.fillStyle = color;
    pen.lineWidth = 1.5 * ratio;
    for (let body = 0; body < data.bodies; body++) {
      for (let part = 0; part < TRAIL_PARTS; part++) {
        const start = Math.max(0, frame - reach * (1 - part / TRAIL_PARTS));
        const stop = Math.max(0, frame - reach * (1 - (part + 1) / TRAIL_PARTS));
        pen.globalAlpha = (0.6 * (part + 1)) / TRAIL_PARTS;
        pen.beginPath();
        for (let at = start; at < stop; at += Math.max(1, reach / 40)) pen.lineTo(...onCanvas(place(scene, at, body)));
        pen.lineTo(...onCanvas(place(scene, stop, body)));
        pen.stroke();
      }
      pen.globalAlpha = 1;
      pen.beginPath();
      pen.arc(...onCanvas(place(scene, frame, body)), Math.max(RADIUS * size, SMALLEST_RADIUS * ratio), 0, 2 * Math.PI);
      pen.fill();
    }
  }

  function draw() {
    state.scenes.forEach((scene, k) => drawScene(canvases[k], scene));
    find(".clock").textContent = `${state.time.toFixed(1)} s of ${duration.toFixed(1)} s`;
    find(".word").textContent = state.playing ? "Stop" : "Play";
    section.dataset.playing = state.playing;
  }

  function advance(now) {
    if (!state.playing) return;
    const step = Math.min(Math.max((now - state.last) / 1000, 0), LONGEST_STEP_S);
    state.last = now;
    state.time += step * data.speed;
    if (state.time > duration) state.time = 0;
    draw();
    requestAnimationFrame(advance);
  }

  function toggle() {
    state.playing = !state.playing;
    state.last = performance.now();
    draw();
    if (state.playing) requestAnimationFrame(advance);
  }

  function show(number) {
    Object.assign(state, { pair: number, time: 0, begun: performance.now() });
    state.scenes = data.pairs[number].scenes.map(decode);
    find(".number").textContent = number + 1;
    draw();
  }

  function choose(side) {
    if (state.pair >= data.pairs.length) return;
    const real = realSide(data.pairs[state.pair]);
    const seconds = (performance.now() - state.begun) / 1000;
    if (seconds < FASTEST_S) return;
    answers.push({ pair: state.pair + 1, answer: side, real, right: side === real, seconds });
    if (answers.length < data.pairs.length) show(answers.length);
    else end();
  }

  // How often who guesses is right so many times or more.
  function byChance(right, count) {
    let ways = 1, sum = 0;
    for (let k = 0; k <= count; k++) {
      if (k >= right) sum += ways;
      ways = (ways * (count - k)) / (k + 1);
    }
    return sum / 2 ** count;
  }

  function end() {
    Object.assign(state, { pair: data.pairs.length, playing: false });
    const count = answers.length, right = answers.filter((answer) => answer.right).length;
    const chance = byChance(right, count);
    score.querySelector(".result").textContent =
      `You were right ${right} of ${count} times. Who guesses is right so often, or more often, ` +
      `in ${(100 * chance).toFixed(0)} % of games (binomial p = ${chance.toFixed(3)}).`;
    score.querySelector(".panel").textContent = data.panel === null ? "" :
      `The panel of examiners tells ${(100 * data.panel).toFixed(0)} % of pairs of single samples: ` +
      `about ${(count * data.panel).toFixed(1)} of ${count}.`;
    const rows = score.querySelector("tbody");
    for (const { pair, answer, real, right: hit, seconds } of answers) {
      const row = rows.insertRow();
      const heading = document.createElement("th");
      heading.scope = "row";
      heading.textContent = pair;
      row.append(heading);
      for (const text of [answer, real, hit ? "yes" : "no", `${seconds.toFixed(1)} s`]) row.insertCell().textContent = text;
    }
    section.hidden = true;
    score.hidden = false;
    save();
    score.querySelector("#score-heading").focus();
  }

  function save() {
    const player = score.querySelector(".player").value.replaceAll('"', '""');
    const lines = ["game,player,pair,answer,real,right,seconds"];
    for (const { pair, answer, real, right, seconds } of answers) {
      lines.push(`${data.game},"${player}",${pair},${answer},${real},${Number(right)},${seconds.toFixed(2)}`);
    }
    const link = score.querySelector(".save");
    link.download = `answers-${data.game}.csv`;
    link.href = `data:text/csv;charset=utf-8,${encodeURIComponent(lines.join("\n") + "\n")}`;
  }

  function onKey(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target.closest("input")) return;
    if (section.hidden) return;
    if (event.key === "1" || event.key === "ArrowLeft") choose("left");
    else if (event.key === "2" || event.key === "ArrowRight") choose("right");
    else if (event.key === " " && !event.target.closest("button")) toggle();
    else return;
    event.preventDefault();
  }

  choices.forEach((choice) => choice.addEventListener("click", (event) => {
    if (event.detail > 0) choice.blur();  // after a click or a touch, space stops and plays
    choose(choice.dataset.side);
  }));
  find(".play").addEventListener("click", toggle);
  score.querySelector(".player").addEventListener("input", save);
  document.addEventListener("keydown", onKey);
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  show(0);
  if (!matchMedia("(prefers-reduced-motion: reduce)").matches) toggle();
})();
