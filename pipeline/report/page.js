'use strict';
// A click on a column's title sorts; a second click reverses. Numbers begin with the largest.
document.querySelectorAll('th span').forEach(function (title) {
  title.addEventListener('keydown', function (event) { if (event.key === 'Enter' || event.key === ' ') title.click(); });
  title.addEventListener('click', function () {
    const th = title.parentNode, body = th.closest('table').tBodies[0], isNumber = th.classList.contains('n');
    const first = isNumber ? 'descending' : 'ascending';
    const second = isNumber ? 'ascending' : 'descending';
    const order = th.getAttribute('aria-sort') === first ? second : first;
    th.parentNode.querySelectorAll('th').forEach(function (other) { other.removeAttribute('aria-sort'); });
    th.setAttribute('aria-sort', order);
    const key = function (row) {
      const text = row.cells[th.cellIndex].textContent.replace('\u2212', '-');
      return isNumber ? parseFloat(text) : text;
    };
    // what is no number stays below, whichever the order
    const compare = function (a, b) {
      if (isNumber && (isNaN(a) || isNaN(b))) return isNaN(a) - isNaN(b);
      return (a < b ? -1 : a > b ? 1 : 0) * (order === 'ascending' ? 1 : -1);
    };
    Array.from(body.rows).sort(function (a, b) { return compare(key(a), key(b)); })
      .forEach(function (row) { body.appendChild(row); });
  });
});

const tip = document.createElement('div');
tip.className = 'tip';
tip.hidden = true;
document.body.appendChild(tip);

function showTip(handler, event, item, text) {
  tip.hidden = !text;
  if (!text) return;
  tip.textContent = text;
  const gap = 14, size = tip.getBoundingClientRect();
  const left = Math.min(event.clientX + gap, innerWidth - size.width - 4);
  const above = event.clientY + gap + size.height > innerHeight;
  tip.style.left = Math.max(4, left) + 'px';
  tip.style.top = (above ? event.clientY - gap - size.height : event.clientY + gap) + 'px';
}

// An axis knows which part of it is shown, from 0 to 1 of the whole.
function axisOf(spec, name) {
  const ends = spec.signals.find(function (s) { return s.name === name + 'dom'; }).value;
  const isLog = spec.scales.find(function (s) { return s.name === name; }).type === 'log';
  // rows with names do not zoom
  const isFixed = spec.axes.some(function (a) { return a.scale === name && a.values; });
  const axis = { from: 0, to: 1 };
  axis.domain = function () {
    return [axis.from, axis.to].map(function (t) {
      return isLog ? ends[0] * Math.pow(ends[1] / ends[0], t) : ends[0] + t * (ends[1] - ends[0]);
    });
  };
  axis.show = function (from, length) {
    if (isFixed) return;
    length = Math.min(1, Math.max(0.005, length));
    axis.from = Math.min(1 - length, Math.max(0, from));
    axis.to = axis.from + length;
  };
  return axis;
}

function draw(box) {
  const spec = JSON.parse(box.nextElementSibling.textContent);
  const font = getComputedStyle(document.body).fontFamily;
  const config = { axis: { labelFont: font, titleFont: font }, text: { font: font }, group: { stroke: '#444' } };
  const view = new vega.View(vega.parse(spec, config), { renderer: 'svg', container: box, tooltip: showTip, hover: false });
  const x = axisOf(spec, 'x'), y = axisOf(spec, 'y');
  const pad = spec.padding;
  const frame = function () {
    const r = box.getBoundingClientRect();
    return { left: r.left + pad.left, top: r.top + pad.top, width: view.width(), height: view.signal('height') };
  };
  const update = function () {
    view.signal('xdom', x.domain()).signal('ydom', y.domain()).run();
    const isZoomed = x.to - x.from < 0.999;
    box.classList.toggle('zoomed', isZoomed);
    box.style.touchAction = isZoomed ? 'none' : 'pan-y pinch-zoom';
  };
  // keeps the point (u, v) of the frame, from its lower left corner, in its place
  const zoom = function (factor, u, v) {
    const step = function (axis, at) {
      const length = axis.to - axis.from;
      axis.show(axis.from + at * length * (1 - 1 / factor), length / factor);
    };
    step(x, u);
    step(y, v);
    update();
  };
  const zoomAt = function (event, factor) {
    const f = frame();
    zoom(factor, (event.clientX - f.left) / f.width, 1 - (event.clientY - f.top) / f.height);
  };
  const whole = function () { x.show(0, 1); y.show(0, 1); update(); };

  const fitTo = function (box_px) {
    const width = Math.floor(box_px - pad.left - pad.right);
    if (width < 40 || width === view.width()) return;
    box.parentNode.style.setProperty('--frame', width / 362);
    view.width(width).run();
  };
  const fit = function () { fitTo(box.clientWidth); };
  fit();
  view.run();
  const caption = box.parentNode.querySelector('figcaption');
  if (caption) {
    caption.id = caption.id || 'caption-' + Array.from(document.querySelectorAll('figcaption')).indexOf(caption);
    box.setAttribute('aria-describedby', caption.id);
  }
  update();
  new ResizeObserver(function () { requestAnimationFrame(fit); }).observe(box);

  // half of an A4 page; the style sheet stretches it to what the column has
  addEventListener('beforeprint', function () { fitTo(330); });
  addEventListener('afterprint', fit);

  // the wheel alone scrolls the page
  box.addEventListener('wheel', function (event) {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    zoomAt(event, Math.exp(-0.002 * event.deltaY));
  }, { passive: false });
  box.addEventListener('dblclick', function (event) { if (x.to - x.from < 0.999) whole(); else zoomAt(event, 3); });
  let last = null;
  box.addEventListener('pointerdown', function (event) { last = { x: event.clientX, y: event.clientY }; });
  box.addEventListener('pointermove', function (event) {
    if (!last || !event.buttons || x.to - x.from > 0.999) { last = null; return; }
    if (Math.hypot(event.clientX - last.x, event.clientY - last.y) < 3) return;
    box.setPointerCapture(event.pointerId);
    const f = frame(), lengthX = x.to - x.from, lengthY = y.to - y.from;
    x.show(x.from - (event.clientX - last.x) / f.width * lengthX, lengthX);
    y.show(y.from + (event.clientY - last.y) / f.height * lengthY, lengthY);
    last = { x: event.clientX, y: event.clientY };
    update();
  });
  box.addEventListener('pointerup', function () { last = null; });
  box.addEventListener('pointerleave', function () { tip.hidden = true; });

  const buttons = document.createElement('div');
  buttons.className = 'buttons';
  const add = function (text, name, act) {
    const button = document.createElement('button');
    button.textContent = text;
    button.title = name;
    button.setAttribute('aria-label', text + ': ' + name + ': ' + spec.description);
    button.addEventListener('click', act);
    buttons.appendChild(button);
  };
  add('+', 'zoom in (or Ctrl and wheel)', function () { zoom(1.6, 0.5, 0.5); });
  add('\u2212', 'zoom out', function () { zoom(1 / 1.6, 0.5, 0.5); });
  add('1:1', 'show all (or double click)', whole);
  const save = function (address, ending) {
    const link = document.createElement('a');
    link.href = address;
    link.download = spec.description + ending;
    link.click();
  };
  add('SVG', 'save as a drawing', function () {
    view.toSVG().then(function (svg) {
      const address = URL.createObjectURL(new Blob([svg], { type: 'image/svg+xml' }));
      save(address, '.svg');
      setTimeout(function () { URL.revokeObjectURL(address); }, 1000);
    });
  });
  // 4 times the screen's 96 dots per inch
  add('PNG', 'save as a picture', function () { view.toImageURL('png', 4).then(function (url) { save(url, '.png'); }); });
  box.parentNode.appendChild(buttons);
}
document.querySelectorAll('.chart').forEach(draw);
