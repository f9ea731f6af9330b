(() => {
  "use strict";

  // Curves answer to the pointer: values under it, and a closer look. All numbers come from the drawing itself:
  // `data-axes` says where its axes are (in the units of the drawing) and which values their edges have.
  const DIGITS = 4;       // of a value
  const HINT = "drag for a closer look, double click for the whole";
  const LEAST_DRAG = 6;   // below which a drag is a click (units of the drawing)

  const close = (low, high, part) => low + part * (high - low);
  const value = ({ low, high, log }, part) => (log ? Math.exp(close(Math.log(low), Math.log(high), part)) : close(low, high, part));
  const share = ({ low, high, log }, at) => (log ? Math.log(at / low) / Math.log(high / low) : (at - low) / (high - low));
  const written = (number) => String(Number(number.toPrecision(DIGITS))).replace("-", "\u2212");

  // Corners of a line as numbers: [x, y] in the units of the drawing, a list for each unbroken piece.
  function pieces(path) {
    const found = [];
    for (const [, letter, x, y] of path.getAttribute("d").matchAll(/([ML])\s*([-0-9.e]+)\s+([-0-9.e]+)/g)) {
      if (letter === "M") found.push([]);
      found[found.length - 1].push([Number(x), Number(y)]);
    }
    return found;
  }

  // Height of a line at x, between its corners; undefined where it is not.
  function heightAt(line, x) {
    for (const piece of line) {
      for (let k = 0; k + 1 < piece.length; k++) {
        const [[left, y], [right, next]] = [piece[k], piece[k + 1]];
        if (Math.min(left, right) <= x && x <= Math.max(left, right)) {
          return left === right ? next : y + ((x - left) / (right - left)) * (next - y);
        }
      }
      if (piece.length === 1 && Math.abs(piece[0][0] - x) < 1) return piece[0][1];
    }
    return undefined;
  }

  class Axes {
    constructor(svg, facts) {
      Object.assign(this, facts);
      this.group = svg.querySelector(`[id="${facts.id}"]`);
      this.whole = { x: this.x, y: this.y };
      this.lines = facts.lines.map(({ id, name }) => {
        const path = svg.querySelector(`[id="${id}"] > path`);
        return { name, path, pieces: path ? pieces(path) : [] };
      });
      this.content = null;
    }

    has(x, y) {
      const [left, top, width, height] = this.box;
      return left <= x && x <= left + width && top <= y && y <= top + height;
    }

    // The place of a point of the drawing as it was before it was looked at more closely.
    origin(x, y) {
      const [left, top, width, height] = this.box;
      const across = share(this.whole.x, value(this.x, (x - left) / width));
      const up = share(this.whole.y, value(this.y, (top + height - y) / height));
      return [left + across * width, top + height - up * height];
    }

    texts(x, y) {
      const [left, top, width, height] = this.box;
      const [at] = this.origin(x, y);
      const rows = [[this.xName || "x", written(value(this.x, (x - left) / width)), ""]];
      for (const { name, path, pieces: line } of this.lines) {
        const level = heightAt(line, at);
        if (level === undefined) continue;
        const number = value(this.whole.y, (top + height - level) / height);
        rows.push([name || this.yName || "y", written(number), getComputedStyle(path).stroke]);
      }
      return rows;
    }

    // Put all that is drawn inside the axes into a group that can be moved behind their frame.
    wrap() {
      this.content = [];
      for (const element of [...this.group.querySelectorAll("[clip-path]")]) {
        if (element.closest('[id*="tick_"]')) continue; // rules stay with their ticks
        const frame = document.createElementNS("http://www.w3.org/2000/svg", "g");
        frame.setAttribute("clip-path", element.getAttribute("clip-path"));
        element.removeAttribute("clip-path");
        element.replaceWith(frame);
        frame.append(element);
        this.content.push(element);
      }
    }

    show(x, y) {
      if (!this.content) this.wrap();
      this.x = x;
      this.y = y;
      const [left, top, width, height] = this.box;
      const begin = [share(this.whole.x, x.low), share(this.whole.y, y.high)];
      const scale = [1 / (share(this.whole.x, x.high) - begin[0]), 1 / (begin[1] - share(this.whole.y, y.low))];
      const shift = [left - scale[0] * (left + begin[0] * width), top - scale[1] * (top + (1 - begin[1]) * height)];
      const closer = scale[0] !== 1 || scale[1] !== 1;
      for (const element of this.content) {
        if (closer) element.setAttribute("transform", `matrix(${scale[0]} 0 0 ${scale[1]} ${shift[0]} ${shift[1]})`);
        else element.removeAttribute("transform");
        for (const path of [element, ...element.querySelectorAll("path")]) path.style.vectorEffect = "non-scaling-stroke";
      }
      this.ticks("xtick", this.x === this.whole.x, (mark) => value(this.x, (Number(mark.getAttribute("x")) - left) / width));
      this.ticks("ytick", this.y === this.whole.y, (mark) => value(this.y, (top + height - Number(mark.getAttribute("y"))) / height));
    }

    // Ticks stay where they are, and say what is there now.
    ticks(kind, whole, read) {
      for (const tick of this.group.querySelectorAll(`[id*="${kind}_"]`)) {
        const text = tick.querySelector("text"), mark = tick.querySelector("use");
        if (!text || !mark) continue;
        text.dataset.whole ??= text.textContent;
        text.textContent = whole ? text.dataset.whole : written(read(mark));
      }
    }
  }

  function answer(svg) {
    const figure = svg.closest("figure") || svg.parentElement;
    const all = JSON.parse(svg.dataset.axes).map((facts) => new Axes(svg, facts));
    const drawn = (name, looks) => {
      const element = document.createElementNS("http://www.w3.org/2000/svg", name);
      for (const [key, look] of Object.entries(looks)) element.setAttribute(key, look);
      element.style.display = "none";
      svg.append(element);
      return element;
    };
    const cursor = drawn("line", { stroke: "var(--muted, #66717d)", "stroke-width": 0.6, "pointer-events": "none" });
    const frame = drawn("rect", { fill: "var(--blue, #0072b2)", opacity: 0.15, "pointer-events": "none" });
    const tip = document.createElement("div");
    tip.className = "tip";
    tip.hidden = true;
    figure.append(tip);
    let drag = null;

    const place = (event) => {
      const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return [point.x, point.y];
    };

    function hide() {
      tip.hidden = true;
      cursor.style.display = "none";
    }

    function point(event) {
      const [x, y] = place(event);
      if (drag) return stretch(x, y);
      const axes = all.find((one) => one.has(x, y));
      if (!axes) return hide();
      const [, top, , height] = axes.box;
      for (const [key, at] of Object.entries({ x1: x, x2: x, y1: top, y2: top + height })) cursor.setAttribute(key, at);
      cursor.style.display = "";
      const rows = [...(axes.title ? [[axes.title, "", ""]] : []), ...axes.texts(x, y), [HINT, "", ""]];
      tip.replaceChildren(...rows.map(([name, text, color]) => {
        const row = document.createElement("div");
        const mark = document.createElement("i");
        if (color) mark.style.background = color;
        row.append(mark, text ? `${name}: ${text}` : name);
        if (name === HINT) row.className = "note";
        return row;
      }));
      tip.hidden = false;
      const edges = figure.getBoundingClientRect();
      const right = event.clientX - edges.left + 14 + tip.offsetWidth < figure.clientWidth;
      tip.style.left = `${Math.max(0, event.clientX - edges.left + (right ? 14 : -14 - tip.offsetWidth))}px`;
      tip.style.top = `${event.clientY - edges.top + 12}px`;
    }

    function stretch(x, y) {
      const [left, top, width, height] = drag.axes.box;
      const within = (at, low, high) => Math.min(Math.max(at, low), high);
      drag.end = [within(x, left, left + width), within(y, top, top + height)];
      const [a, b] = [drag.begin, drag.end];
      const looks = { x: Math.min(a[0], b[0]), y: Math.min(a[1], b[1]), width: Math.abs(a[0] - b[0]), height: Math.abs(a[1] - b[1]) };
      for (const [key, look] of Object.entries(looks)) frame.setAttribute(key, look);
      frame.style.display = "";
    }

    function release() {
      if (!drag) return;
      const { axes, begin, end } = drag;
      drag = null;
      frame.style.display = "none";
      if (!end || Math.abs(begin[0] - end[0]) < LEAST_DRAG || Math.abs(begin[1] - end[1]) < LEAST_DRAG) return;
      const [left, top, width, height] = axes.box;
      const across = [begin[0], end[0]].map((at) => value(axes.x, (at - left) / width)).sort((a, b) => a - b);
      const up = [begin[1], end[1]].map((at) => value(axes.y, (top + height - at) / height)).sort((a, b) => a - b);
      show(axes, { ...axes.x, low: across[0], high: across[1] }, { ...axes.y, low: up[0], high: up[1] });
    }

    // Panels that share an axis show the same part of it, all of it where no part is said.
    function show(axes, x, y) {
      for (const panel of all) {
        const across = panel.xGroup === axes.xGroup, up = panel.yGroup === axes.yGroup;
        if (across || up) panel.show(across ? x ?? panel.whole.x : panel.x, up ? y ?? panel.whole.y : panel.y);
      }
    }

    svg.addEventListener("pointermove", point);
    svg.addEventListener("pointerleave", () => { if (!drag) hide(); });
    svg.addEventListener("pointerdown", (event) => {
      const [x, y] = place(event), axes = all.find((one) => one.has(x, y));
      if (!axes || event.button !== 0 || event.pointerType !== "mouse") return point(event);
      drag = { axes, begin: [x, y], end: null };
      svg.setPointerCapture(event.pointerId);
      event.preventDefault();
      hide();
    });
    svg.addEventListener("pointerup", release);
    svg.addEventListener("dblclick", (event) => {
      const [x, y] = place(event), axes = all.find((one) => one.has(x, y));
      if (axes) show(axes);
    });
  }

  document.querySelectorAll("svg[data-axes]").forEach(answer);
})();
