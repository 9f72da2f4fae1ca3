// Cursor and zoom of the plots of a page. Everything it needs is in the SVG: `data-frame` of each
// plot has the ends of its axes in their units and in pixels of the drawing.
"use strict";
(function () {
  // Vertices of a path that this program wrote: M, L, H, V with absolute numbers, h0 of a dot.
  function points(d) {
    const found = [];
    let x = 0, y = 0;
    for (const [, command, rest] of d.matchAll(/([MLHVh])([^MLHVh]*)/g)) {
      const numbers = rest.trim().split(/[ ,]+/).map(Number);
      if (command === "M" || command === "L") { [x, y] = numbers; }
      else if (command === "H") { x = numbers[0]; }
      else if (command === "V") { y = numbers[0]; }
      else { continue; }
      found.push([x, y]);
    }
    return found;
  }

  // The point nearest to an abscissa; of several the last, as a step is read after it.
  function nearest(points, x) {
    let best = null;
    for (const point of points) {
      if (!best || Math.abs(point[0] - x) <= Math.abs(best[0] - x)) best = point;
    }
    return best;
  }

  // At most about `count` round numbers between two ends, and their decimals.
  function ticks(low, high, count) {
    const raw = (high - low) / count;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.999);
    const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) {
      found.push((k * step).toFixed(decimals).replace("-", "\u2212"));
    }
    return found;
  }

  // Value of a pixel on an axis `{low, high, from, to}`, and the pixel of a value. Values of a
  // logarithmic axis (`log`) are powers of ten throughout; they are shown as what they stand for.
  const valueOf = (axis, pixel) =>
    axis.low + ((pixel - axis.from) / (axis.to - axis.from)) * (axis.high - axis.low);
  const pixelOf = (axis, value) =>
    axis.from + ((value - axis.low) / (axis.high - axis.low)) * (axis.to - axis.from);

  // Digits that a pixel of the axis tells.
  function readable(axis, value) {
    if (axis.log) return String(Number((10 ** value).toPrecision(3)));
    const pixel = Math.abs((axis.high - axis.low) / (axis.to - axis.from));
    const decimals = Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(pixel || 1))));
    return value.toFixed(decimals).replace("-", "\u2212");
  }

  const tools = { points, nearest, ticks, valueOf, pixelOf, readable };
  if (typeof document === "undefined") { globalThis.sinewPlot = tools; return; }

  const element = (name, attributes, parent) => {
    const made = document.createElementNS(parent.namespaceURI, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    parent.appendChild(made);
    return made;
  };

  const plots = [...document.querySelectorAll("svg[data-frame]")].map((svg) => {
    const frame = JSON.parse(svg.dataset.frame);
    const named = [...svg.querySelectorAll("path.series")].filter((path) => path.querySelector("title"));
    const series = named.map((path) => ({
      name: path.querySelector("title").textContent,
      points: points(path.getAttribute("d")),
    }));
    const line = element("path", { class: "cursor", d: "" }, svg);
    const box = element("rect", { class: "chosen", y: frame.y.to, width: 0,
      height: frame.y.from - frame.y.to }, svg);
    const readout = document.createElement("output");
    svg.parentNode.querySelector("figcaption").appendChild(readout);
    svg.setAttribute("tabindex", "0");
    return { svg, frame, whole: { ...frame.x }, series, line, box, readout };
  });

  // Plots over the same quantity from and to the same ends move together.
  const together = (plot) => plots.filter((other) => other.frame.xUnit === plot.frame.xUnit
    && other.whole.low === plot.whole.low && other.whole.high === plot.whole.high);

  function show(plot, value) {
    for (const other of together(plot)) {
      const { frame, whole, series, line, readout } = other;
      if (value === null || value < frame.x.low || value > frame.x.high) {
        line.setAttribute("d", "");
        readout.textContent = "";
        continue;
      }
      const pixel = pixelOf(frame.x, value);
      line.setAttribute("d", `M${pixel} ${frame.y.to}V${frame.y.from}`);
      const drawn = pixelOf(whole, value);
      const read = series.filter((one) => one.points.length > 0).map((one) => {
        const [, y] = nearest(one.points, drawn);
        return `${one.name} ${readable(frame.y, valueOf(frame.y, y))} ${frame.yUnit}`.trim();
      });
      const at = `${readable(frame.x, value)} ${frame.xUnit}`.trim();
      readout.textContent = `at ${at}: ${read.join(", ")}`;
    }
  }

  function zoom(plot, low, high) {
    const smallest = (plot.whole.high - plot.whole.low) * 1e-4;
    const seen = Math.min(high, plot.whole.high) - Math.max(low, plot.whole.low);
    if (!(seen > smallest)) return;
    for (const { svg, frame, whole } of together(plot)) {
      frame.x.low = Math.max(low, whole.low);
      frame.x.high = Math.min(high, whole.high);
      const factor = (whole.high - whole.low) / (frame.x.high - frame.x.low);
      const shift = frame.x.from - factor * pixelOf(whole, frame.x.low);
      for (const group of svg.querySelectorAll("g.moves")) {
        group.setAttribute("transform", `matrix(${factor} 0 0 1 ${shift} 0)`);
      }
      for (const old of svg.querySelectorAll(".along")) old.remove();
      for (const tick of ticks(frame.x.low, frame.x.high, 10)) {
        const value = Number(tick.replace("\u2212", "-"));
        const x = pixelOf(frame.x, value);
        element("path", { class: "axis along", d: `M${x} ${frame.y.from}v5` }, svg);
        element("text", { class: "tick along", x, y: frame.y.from + 18,
          "text-anchor": "middle" }, svg).textContent = frame.x.log ? readable(frame.x, value) : tick;
      }
    }
    show(plot, null);
  }
  const reset = (plot) => zoom(plot, plot.whole.low, plot.whole.high);

  for (const plot of plots) {
    const { svg, frame, box } = plot;
    const at = (event) => {
      const matrix = svg.getScreenCTM();
      const pixel = (event.clientX - matrix.e) / matrix.a;
      const inside = Math.min(Math.max(pixel, frame.x.from), frame.x.to);
      return valueOf(frame.x, inside);
    };
    let begun = null;
    let shown = null;
    const draw = (value) => { shown = value; show(plot, value); };
    svg.addEventListener("pointerdown", (event) => {
      begun = at(event);
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", (event) => {
      const value = at(event);
      draw(value);
      if (begun === null) return;
      const ends = [begun, value].map((v) => pixelOf(frame.x, v)).sort((a, b) => a - b);
      box.setAttribute("x", ends[0]);
      box.setAttribute("width", ends[1] - ends[0]);
    });
    svg.addEventListener("pointerup", (event) => {
      box.setAttribute("width", 0);
      const ends = [begun, at(event)].sort((a, b) => a - b);
      const pixels = pixelOf(frame.x, ends[1]) - pixelOf(frame.x, ends[0]);
      if (begun !== null && pixels > 8) zoom(plot, ...ends);
      begun = null;
    });
    svg.addEventListener("pointerleave", () => draw(null));
    svg.addEventListener("dblclick", () => reset(plot));
    svg.addEventListener("keydown", (event) => {
      const { low, high } = frame.x;
      const middle = shown ?? (low + high) / 2;
      const step = (high - low) / 100;
      if (event.key === "ArrowLeft") draw(Math.max(low, middle - step));
      else if (event.key === "ArrowRight") draw(Math.min(high, middle + step));
      else if (event.key === "+") zoom(plot, (low + middle) / 2, (high + middle) / 2);
      else if (event.key === "-") zoom(plot, 2 * low - middle, 2 * high - middle);
      else if (event.key === "Escape") reset(plot);
      else return;
      event.preventDefault();
    });
  }

  // `page.html#t=2,4` opens at these seconds.
  const asked = /^#t=(-?[\d.e+-]+),(-?[\d.e+-]+)$/.exec(location.hash);
  const timed = plots.filter((plot) => plot.frame.xUnit === "s");
  if (asked) for (const plot of timed) zoom(plot, Number(asked[1]), Number(asked[2]));
  if (plots.length > 0) {
    plots[0].readout.textContent = "drag over a plot to zoom, double-click for all of it; keys: \
\u2190 \u2192 + \u2212 Esc";
  }
})();
