// What tests/screen_layout.py asks a page: a list of what is wrong in its layout.
({leastText, leastTarget}) => {
  const top = document.querySelector("dialog[open]") ?? document.body;
  const seen = node => node.checkVisibility({visibilityProperty: true}) && !node.closest(".visually-hidden") && node.getClientRects().length > 0;
  const name = node => node.id || node.className?.baseVal || node.className || node.tagName;
  const all = [...top.querySelectorAll("*")].filter(node => seen(node) && (top !== document.body || !node.closest("dialog")));
  const lost = document.querySelector("#connection-lost:not([hidden])");
  const free = all.filter(node => !lost || lost.contains(node));
  const scrolls = node => ["auto", "scroll"].includes(getComputedStyle(node).overflowY) || ["auto", "scroll"].includes(getComputedStyle(node).overflowX);
  const inScroller = node => { for (let up = node.parentElement; up; up = up.parentElement) if (scrolls(up)) return true; return false; };
  const box = node => node.getBoundingClientRect();
  const own = node => [...node.childNodes].some(child => child.nodeType === 3 && child.textContent.trim());
  const wrong = [];
  const root = document.documentElement;
  if (root.scrollWidth > innerWidth || root.scrollHeight > innerHeight) wrong.push(`page ${root.scrollWidth} x ${root.scrollHeight}`);
  for (const node of free.filter(own)) {
    const size = parseFloat(getComputedStyle(node).fontSize) * (node.ownerSVGElement ? box(node.ownerSVGElement).width / (node.ownerSVGElement.viewBox.baseVal.width || box(node.ownerSVGElement).width) : 1);
    if (size > 0 && size < leastText - 0.01 && !node.ownerSVGElement) wrong.push(`text ${name(node)} ${size.toFixed(1)} px`);
    if (inScroller(node) || node.closest("svg")) continue;
    const text = document.createRange();
    text.selectNodeContents(node);
    const words = text.getBoundingClientRect();
    if (words.left < -1 || words.top < -1 || words.right > innerWidth + 1 || words.bottom > innerHeight + 1) wrong.push(`outside ${name(node)}`);
    for (let up = node; up && up !== root; up = up.parentElement) {
      if (getComputedStyle(up).overflow === "visible" || getComputedStyle(up).textOverflow === "ellipsis") continue;
      const edge = box(up);
      if (words.right > edge.right + 1.5 || words.bottom > edge.bottom + 1.5 || words.top < edge.top - 1.5) wrong.push(`cut ${name(node)} in ${name(up)}`);
    }
  }
  for (const node of free.filter(one => one.matches(".faults, .tile, .mode-words, .header, .footer, .instruction, .scan, .dialog-header"))) {
    if (node.scrollHeight > node.clientHeight + 2 || node.scrollWidth > node.clientWidth + 2) wrong.push(`full ${name(node)} ${node.scrollWidth} x ${node.scrollHeight} in ${node.clientWidth} x ${node.clientHeight}`);
  }
  for (const node of free.filter(one => one.matches("button, a[href], input, select"))) {
    const target = box(node.closest("label") ?? node);
    if (target.width < leastTarget - 0.5 || target.height < leastTarget - 0.5) wrong.push(`target ${name(node)} ${target.width.toFixed(0)} x ${target.height.toFixed(0)}`);
  }
  for (const node of free.filter(one => one.matches("button, label") && inScroller(one))) {
    for (let up = node.parentElement; up; up = up.parentElement) if (scrolls(up) && box(node).left < box(up).left - 0.5 && up.scrollLeft === 0) wrong.push(`out of reach ${name(node)} ${node.textContent.trim()}`);
  }
  const blocks = free.filter(node => node.matches(".instruction, .buttons, .faults, .modes, .until, .schematic, .scan, .live-view, .force-value, .force-word, .frames-row, .frame-cells, .gauge-zones, .gauge-track, .gauge-ticks, .tile, .image, .repeats, .kept-warnings, .acts, .header, .footer, .beside"));
  blocks.forEach((one, index) => blocks.slice(index + 1).forEach(other => {
    if (one.contains(other) || other.contains(one) || inScroller(one) || inScroller(other)) return;
    const [a, b] = [box(one), box(other)];
    const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
    const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
    if (across > 1.5 && down > 1.5) wrong.push(`${name(one)} over ${name(other)} by ${across.toFixed(0)} x ${down.toFixed(0)}`);
  }));
  return [...new Set(wrong)];
}
