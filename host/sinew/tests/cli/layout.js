// Layout of a page as facts: what sticks out, overlaps, is empty, too small or too faint.
(() => {
  const found = { outside: [], overlaps: [], flat: [], small: [], faint: [], plots: 0 };
  const wide = document.documentElement.clientWidth;
  found.width = wide;
  found.scroll = document.documentElement.scrollWidth;
  found.height = document.documentElement.scrollHeight;

  // A box that scrolls by itself may be wider than the page; only what is seen of it counts.
  const scroller = (node) => node.closest(".wide, pre");
  const seen = (rect, node) => {
    const around = scroller(node);
    if (!around) return rect;
    const limit = around.getBoundingClientRect();
    return { left: Math.max(rect.left, limit.left), right: Math.min(rect.right, limit.right),
      top: rect.top, bottom: rect.bottom };
  };
  const texts = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const parent = node.parentElement;
    const text = node.textContent.trim();
    if (!text || parent.closest("style, script, title")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const whole of range.getClientRects()) {
      const rect = seen(whole, parent);
      if (rect.right - rect.left < 1 || rect.bottom - rect.top < 1) continue;
      texts.push({ node, parent, text: text.slice(0, 40), rect });
      if (rect.left < -1 || rect.right > wide + 1) found.outside.push(text.slice(0, 40));
    }
  }
  for (const svg of document.querySelectorAll("svg[data-frame]")) {
    const box = svg.getBoundingClientRect();
    if (box.left < -1 || box.right > wide + 1) found.outside.push(svg.getAttribute("aria-label"));
  }

  texts.sort((a, b) => a.rect.top - b.rect.top);
  for (let i = 0; i < texts.length; i += 1) {
    for (let j = i + 1; j < texts.length && texts[j].rect.top < texts[i].rect.bottom; j += 1) {
      const [a, b] = [texts[i], texts[j]];
      if (a.node === b.node) continue;
      const across = Math.min(a.rect.right, b.rect.right) - Math.max(a.rect.left, b.rect.left);
      const down = Math.min(a.rect.bottom, b.rect.bottom) - Math.max(a.rect.top, b.rect.top);
      // Boxes of a font have room above and below its letters.
      const height = Math.min(a.rect.bottom - a.rect.top, b.rect.bottom - b.rect.top);
      if (across > 1 && down > 0.35 * height) found.overlaps.push(`${a.text} | ${b.text}`);
    }
  }

  for (const svg of document.querySelectorAll("svg[data-frame]")) {
    found.plots += 1;
    const box = svg.getBoundingClientRect();
    const series = [...svg.querySelectorAll("path.series")];
    const drawn = series.some((path) => path.getBoundingClientRect().width > 0.2 * box.width);
    const said = svg.querySelector(".empty") !== null;
    if (box.width < 0.7 * (Math.min(wide, 990) - 40) || box.height < 50 || !(drawn || said)) {
      found.flat.push(svg.getAttribute("aria-label"));
    }
  }

  const channel = (v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
  const parse = (text) => (text.match(/[\d.]+/g) || []).map(Number);
  const luminance = ([r, g, b]) =>
    0.2126 * channel(r / 255) + 0.7152 * channel(g / 255) + 0.0722 * channel(b / 255);
  const ground = (element) => {
    for (let at = element; at; at = at.parentElement) {
      const colour = parse(getComputedStyle(at).backgroundColor);
      if (colour.length === 3 || colour[3] === 1) return luminance(colour);
    }
    return 1;
  };
  const contrast = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  found.ground = ground(document.body);
  for (const { parent, text, rect } of texts) {
    const style = getComputedStyle(parent);
    const inDrawing = parent instanceof SVGElement;
    const colour = parse(inDrawing ? style.fill : style.color);
    if (contrast(luminance(colour), ground(parent)) < 4.5) found.faint.push(text);
    const scale = inDrawing ? parent.getScreenCTM().a : 1;
    if (parseFloat(style.fontSize) * scale < 9) found.small.push(text);
  }
  for (const path of document.querySelectorAll("svg[data-frame] path.series")) {
    const colour = parse(getComputedStyle(path).stroke);
    if (contrast(luminance(colour), ground(path)) < 3) found.faint.push(path.textContent);
  }
  return found;
})()
