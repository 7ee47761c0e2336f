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

function showTip(event, text) {
  tip.hidden = !text;
  if (!text) return;
  tip.textContent = text;
  const gap = 14, size = tip.getBoundingClientRect();
  const left = Math.min(event.clientX + gap, innerWidth - size.width - 4);
  const above = event.clientY + gap + size.height > innerHeight;
  tip.style.left = Math.max(4, left) + 'px';
  tip.style.top = (above ? event.clientY - gap - size.height : event.clientY + gap) + 'px';
}

const svgName = 'http://www.w3.org/2000/svg';
function add(parent, name, attributes, text) {
  const child = document.createElementNS(svgName, name);
  for (const key in attributes) child.setAttribute(key, attributes[key]);
  child.textContent = text || '';
  parent.appendChild(child);
}

// Multiples of the smallest step of 1, 2 or 5 times a power of ten that gives no more than six of them.
function ticks(low, high) {
  const power = Math.pow(10, Math.floor(Math.log10((high - low) / 5)));
  const step = [1, 2, 5, 10].map(function (n) { return n * power; }).find(function (s) { return (high - low) / s <= 5; });
  const list = [];
  for (let i = Math.ceil(low / step); i * step <= high; ++i) list.push(i * step);
  return list;
}

// The ticks of the part of an axis that is shown, from 0 to 1 of the whole.
function drawAxis(group, whole, frame, from, to) {
  if (from === 0 && to === 1) { group.innerHTML = whole; return; }
  const ends = group.dataset.ends.split(' ').map(Number), side = group.dataset.side;
  const isLog = group.dataset.scale === 'log';
  const at = function (t) {
    return isLog ? ends[0] * Math.pow(ends[1] / ends[0], t) : ends[0] + t * (ends[1] - ends[0]);
  };
  const low = at(from), high = at(to);
  group.textContent = '';
  ticks(Math.min(low, high), Math.max(low, high)).forEach(function (value) {
    const share = isLog ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    const text = String(+value.toPrecision(6)).replace('-', '\u2212'), right = frame.x + frame.width;
    const x = frame.x + share * frame.width, y = frame.y + (1 - share) * frame.height, bottom = frame.y + frame.height;
    if (side === 'y') {
      add(group, 'path', { d: 'M' + frame.x + ',' + y + 'H' + right, stroke: '#e3e5e8' });
      add(group, 'text', { x: frame.x - 6, y: y + 5, 'text-anchor': 'end' }, text);
    } else {
      const isUpper = side === 'x2';
      add(group, 'path', { d: 'M' + x + ',' + frame.y + (isUpper ? 'v-4' : 'V' + bottom), stroke: isUpper ? '#444' : '#e3e5e8' });
      add(group, 'text', { x: x, y: isUpper ? frame.y - 7 : bottom + 17, 'text-anchor': 'middle' }, text);
    }
  });
}

function draw(box) {
  const svg = box.querySelector('svg'), ink = svg.querySelector('.ink'), name = box.getAttribute('aria-label');
  const view = ink.viewBox.baseVal, frame = { x: view.x, y: view.y, width: view.width, height: view.height };
  const axes = Array.from(svg.querySelectorAll('.axis')).map(function (group) { return { group: group, whole: group.innerHTML }; });
  // rows with names do not zoom
  const isFixed = function (side) { return !svg.querySelector('.axis[data-side=' + side + ']').dataset.ends; };
  const fixed = { x: isFixed('x'), y: isFixed('y') };
  // what is shown: from 0 to 1, from the lower left corner
  const x = { from: 0, length: 1 }, y = { from: 0, length: 1 };
  const show = function (axis, from, length) {
    if (fixed[axis === x ? 'x' : 'y']) return;
    axis.length = Math.min(1, Math.max(0.005, length));
    axis.from = Math.min(1 - axis.length, Math.max(0, from));
  };
  const isZoomed = function () { return Math.min(x.length, y.length) < 0.999; };
  const update = function () {
    ink.setAttribute('viewBox', [frame.x + x.from * frame.width, frame.y + (1 - y.from - y.length) * frame.height,
      x.length * frame.width, y.length * frame.height].join(' '));
    // dots and names keep their size
    ink.style.setProperty('--x', x.length);
    ink.style.setProperty('--y', y.length);
    axes.forEach(function (axis) {
      const part = axis.group.dataset.side === 'y' ? y : x;
      if (axis.group.dataset.ends) drawAxis(axis.group, axis.whole, frame, part.from, part.length < 1 ? part.from + part.length : 1);
    });
    box.classList.toggle('zoomed', isZoomed());
    box.style.touchAction = isZoomed() ? 'none' : 'pan-y pinch-zoom';
  };
  // keeps the point (u, v) of the frame, from its lower left corner, in its place
  const zoom = function (factor, u, v) {
    const step = function (axis, at) { show(axis, axis.from + at * axis.length * (1 - 1 / factor), axis.length / factor); };
    step(x, u);
    step(y, v);
    update();
  };
  const px = function () { return svg.getBoundingClientRect().width / svg.viewBox.baseVal.width; };
  const origin = function () {
    const r = svg.getBoundingClientRect(), k = px(), top = svg.viewBox.baseVal;
    return { left: r.left + k * (frame.x - top.x), top: r.top + k * (frame.y - top.y), width: k * frame.width, height: k * frame.height };
  };
  const zoomAt = function (event, factor) {
    const f = origin();
    zoom(factor, (event.clientX - f.left) / f.width, 1 - (event.clientY - f.top) / f.height);
  };
  const whole = function () { show(x, 0, 1); show(y, 0, 1); update(); };

  // text is as large in every chart
  const fit = function () {
    if (!box.clientWidth) return;
    svg.setAttribute('font-size', 13 / px());
    box.parentNode.style.setProperty('--frame', px());
  };
  fit();
  new ResizeObserver(function () { requestAnimationFrame(fit); }).observe(box);
  addEventListener('beforeprint', function () { svg.setAttribute('font-size', 13 * svg.viewBox.baseVal.width / 400); });
  addEventListener('afterprint', fit);

  // what the browser would show late is shown at once
  ink.querySelectorAll('title').forEach(function (title) {
    title.parentNode.dataset.tip = title.textContent;
    title.remove();
  });
  box.addEventListener('pointerover', function (event) { showTip(event, event.target.dataset.tip); });
  box.addEventListener('pointerleave', function () { tip.hidden = true; });

  // the wheel alone scrolls the page
  box.addEventListener('wheel', function (event) {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    zoomAt(event, Math.exp(-0.002 * event.deltaY));
  }, { passive: false });
  box.addEventListener('dblclick', function (event) { if (isZoomed()) whole(); else zoomAt(event, 3); });
  let last = null;
  box.addEventListener('pointerdown', function (event) { last = { x: event.clientX, y: event.clientY }; });
  box.addEventListener('pointermove', function (event) {
    if (!last || !event.buttons || !isZoomed()) { last = null; return; }
    if (Math.hypot(event.clientX - last.x, event.clientY - last.y) < 3) return;
    box.setPointerCapture(event.pointerId);
    const f = origin();
    show(x, x.from - (event.clientX - last.x) / f.width * x.length, x.length);
    show(y, y.from + (event.clientY - last.y) / f.height * y.length, y.length);
    last = { x: event.clientX, y: event.clientY };
    update();
  });
  box.addEventListener('pointerup', function () { last = null; });

  const buttons = document.createElement('div');
  buttons.className = 'buttons';
  const addButton = function (text, what, act) {
    const button = document.createElement('button');
    button.textContent = text;
    button.title = what;
    button.setAttribute('aria-label', text + ': ' + what + ': ' + name);
    button.addEventListener('click', act);
    buttons.appendChild(button);
  };
  addButton('+', 'zoom in (or Ctrl and wheel)', function () { zoom(1.6, 0.5, 0.5); });
  addButton('\u2212', 'zoom out', function () { zoom(1 / 1.6, 0.5, 0.5); });
  addButton('1:1', 'show all (or double click)', whole);
  const save = function (address, ending) {
    const link = document.createElement('a');
    link.href = address;
    link.download = name + ending;
    link.click();
  };
  const address = function () {
    const copy = svg.cloneNode(true), size = svg.viewBox.baseVal;
    copy.setAttribute('xmlns', svgName);
    copy.setAttribute('width', size.width);
    copy.setAttribute('height', size.height);
    copy.setAttribute('font-family', getComputedStyle(document.body).fontFamily);
    copy.setAttribute('style', 'background:#fff');
    return URL.createObjectURL(new Blob([new XMLSerializer().serializeToString(copy)], { type: 'image/svg+xml' }));
  };
  addButton('SVG', 'save as a drawing', function () { save(address(), '.svg'); });
  addButton('PNG', 'save as a picture', function () {
    const image = new Image(), canvas = document.createElement('canvas'), size = svg.viewBox.baseVal;
    image.onload = function () {
      canvas.width = 4 * size.width; // 4 times the screen's 96 dots per inch
      canvas.height = 4 * size.height;
      canvas.getContext('2d').drawImage(image, 0, 0, canvas.width, canvas.height);
      save(canvas.toDataURL('image/png'), '.png');
    };
    image.src = address();
  });
  box.parentNode.appendChild(buttons);
}
document.querySelectorAll('.chart').forEach(draw);
