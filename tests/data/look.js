// What tests/endtoend/pages.cpp asks of a page.
window.look = {
  // What a screen reader is given (WCAG 2.1: 1.1.1, 1.3.1, 2.5.3, 4.1.2), of what axe-core asks.
  lists() {
    const all = s => [...document.querySelectorAll(s)], shown = e => e.outerHTML.slice(0, 200);
    const name = e => (e.getAttribute('aria-label') || e.textContent || e.title || '').trim();
    const hidden = e => e.closest('[aria-hidden=true]');
    return {
      nameless: all('button, a, summary, [role=button], input, select').filter(e => !name(e)).map(shown),
      spoken_otherwise: all(':is(button, a)[aria-label]').filter(e => e.textContent.trim() &&
        !e.getAttribute('aria-label').startsWith(e.textContent.trim())).map(shown),
      images: all('img').filter(e => !e.hasAttribute('alt')).map(shown),
      charts: all('.chart').filter(e => e.getAttribute('role') !== 'img' ||
        !e.getAttribute('aria-label')).map(shown),
      marks: all('svg [role=graphics-symbol]').filter(e => !hidden(e) && !e.getAttribute('aria-label')).map(shown),
      tables: all('table').filter(e => !e.caption || !e.caption.textContent.trim()).map(shown),
      figures: all('figure').filter(e => !e.querySelector('h3')).map(shown),
      twice: all('[id]').map(e => e.id).filter((id, i, ids) => ids.indexOf(id) !== i),
      headings: all('h1, h2, h3, h4').filter((e, i, list) => i && +e.tagName[1] > +list[i - 1].tagName[1] + 1).map(shown)
    };
  },

  // WCAG 2.1, 1.4.3
  faint() {
    const rgba = c => {
      const n = (c.match(/[\d.]+/g) || [0, 0, 0, 0]).map(Number);
      return n.length < 4 ? [...n, 1] : n;
    };
    const light = c => c.slice(0, 3).map(v => { v /= 255; return v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4; })
      .reduce((sum, v, i) => sum + v * [.2126, .7152, .0722][i], 0);
    const behind = e => {
      for (; e; e = e.parentElement) {
        const c = rgba(getComputedStyle(e).backgroundColor);
        if (c[3] > .99) return c;
      }
      return [255, 255, 255, 1];
    };
    const list = [];
    for (const e of document.querySelectorAll('main *')) {
      if (['SCRIPT', 'STYLE', 'NOSCRIPT'].includes(e.tagName) || !e.getClientRects().length) continue;
      if (![...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())) continue;
      const style = getComputedStyle(e), isDrawn = Boolean(e.ownerSVGElement);
      if (isDrawn && style.stroke !== 'none') continue; // the rim itself
      const ink = rgba(isDrawn ? style.fill : style.color), ground = behind(e.ownerSVGElement || e);
      const [a, b] = [light(ink), light(ground)].sort((p, q) => q - p), ratio = (a + .05) / (b + .05);
      const size = parseFloat(style.fontSize), isLarge = size >= 24 || (size >= 18.66 && style.fontWeight >= 700);
      if (ratio < (isLarge ? 3 : 4.5)) list.push(ratio.toFixed(2) + ' ' + e.outerHTML.slice(0, 200));
    }
    return list;
  },

  // in px of the screen: of drawings that the page scales, too
  small() {
    return [...document.querySelectorAll('main *')].filter(e => [...e.childNodes].some(n => n.nodeType === 3 &&
      n.data.trim()) && !['SCRIPT', 'STYLE', 'NOSCRIPT'].includes(e.tagName) &&
      parseFloat(getComputedStyle(e).fontSize) * (e.getScreenCTM ? Math.hypot(e.getScreenCTM().c, e.getScreenCTM().d) : 1)
      < 11.99).map(e => e.outerHTML.slice(0, 200));
  },

  // names and numbers along an axis
  overlapping() {
    return [...document.querySelectorAll('.chart .axis')].flatMap(axis => {
      const texts = [...axis.querySelectorAll('text')].filter(e => e.textContent);
      const boxes = texts.map(e => e.getBoundingClientRect());
      const meet = (r, q) => r.left < q.right && q.left < r.right && r.top < q.bottom - 2 && q.top < r.bottom - 2;
      return texts.filter((e, i) => boxes.some((q, j) => j > i && meet(boxes[i], q))).map(e => e.textContent);
    });
  }
};
0
