// Three views of a shape over time. `shape` stands before this script: see animation.rs.
(() => {
  const root = document.querySelector(".animation");
  const [button, slider, clock] = ["button", "input", "output"].map((tag) => root.querySelector(tag));
  const views = [
    { title: "from the side, x to the right, z up", x: (p) => p[0], y: (p) => -p[2] },
    { title: "from the side, y to the right, z up", x: (p) => p[1], y: (p) => -p[2] },
    { title: "from above, x to the right, y up", x: (p) => p[0], y: (p) => -p[1] },
  ];
  // Where each outline begins in a picture, and what leaves a trace: ends of chains and tips of plates.
  let at = 0;
  for (const outline of shape.outlines) {
    outline.at = at;
    at += 3 * outline.points;
  }
  const points = (picture, outline) =>
    Array.from({ length: outline.points }, (_, k) => picture.slice(outline.at + 3 * k, outline.at + 3 * k + 3));
  const traced = shape.outlines.filter((o) => o.role === "chain" || o.role === "tip");

  const svg = (tag, parent, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const name in attributes) element.setAttribute(name, attributes[name]);
    return parent.appendChild(element);
  };
  const line = (view, list) =>
    list.length === 1
      ? `M${view.x(list[0])} ${view.y(list[0])}h0`
      : "M" + list.map((p) => `${view.x(p)} ${view.y(p)}`).join("L");

  for (const view of views) {
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (const picture of shape.pictures) {
      for (let k = 0; k < picture.length; k += 3) {
        const p = [picture[k], picture[k + 1], picture[k + 2]];
        [view.x(p), view.y(p)].forEach((c, i) => {
          low[i] = Math.min(low[i], c);
          high[i] = Math.max(high[i], c);
        });
      }
    }
    const size = 1.15 * Math.max(high[0] - low[0], high[1] - low[1], 1);
    const corner = [0, 1].map((i) => (low[i] + high[i] - size) / 2);
    const figure = root.querySelector(".views").appendChild(document.createElement("figure"));
    const drawing = svg("svg", figure, { viewBox: `${corner[0]} ${corner[1]} ${size} ${size}`, role: "img" });
    figure.appendChild(document.createElement("figcaption")).textContent = view.title;
    svg("path", drawing, { class: "ground", d: `M${corner[0]} 0h${size}M0 ${corner[1]}v${size}` });
    for (const outline of traced) {
      const ends = shape.pictures.map((picture) => points(picture, outline).at(-1));
      svg("path", drawing, { class: "trace", d: line(view, ends) });
    }
    view.paths = shape.outlines.map((o) => svg("path", drawing, { class: o.role }));
    view.paths.forEach((path, i) => {
      svg("title", path, {}).textContent = shape.outlines[i].name;
    });
  }

  const show = (index) => {
    const picture = shape.pictures[index];
    for (const view of views) {
      shape.outlines.forEach((o, i) => view.paths[i].setAttribute("d", line(view, points(picture, o))));
    }
    slider.value = index;
    clock.textContent = `${shape.times[index].toFixed(2)} s`;
  };
  // Playing keeps the recording's own time: `began` is when its first row would have been shown.
  let playing = true, began = null;
  const seconds = () => shape.times[slider.value] - shape.times[0];
  const tick = (now) => {
    if (playing) {
      began ??= now - 1000 * seconds();
      const wanted = shape.times[0] + (now - began) / 1000;
      let index = Number(slider.value);
      while (index + 1 < shape.times.length && shape.times[index + 1] <= wanted) index += 1;
      if (index + 1 === shape.times.length && wanted > shape.times[index] + 0.5) {
        index = 0;
        began = null;
      }
      if (index !== Number(slider.value)) show(index);
    }
    requestAnimationFrame(tick);
  };
  button.onclick = () => {
    playing = !playing;
    began = null;
    button.textContent = playing ? "Pause" : "Play";
  };
  slider.oninput = () => {
    began = null;
    show(Number(slider.value));
  };
  show(0);
  requestAnimationFrame(tick);
})();
