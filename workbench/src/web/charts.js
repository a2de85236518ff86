'use strict';
// Charts for the report and the dashboard: uPlot with our colours, units on hover, zoom by drag, pinch and keys.
const Charts = (() => {
  const DEGREES = 180 / Math.PI;
  const all = new Set();

  const colour = name => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  let inks = {};
  const ink = name => inks[name] || (inks[name] = colour(name));

  // Three significant digits, a real minus sign.
  function number(v) {
    if (v == null || !isFinite(v)) return '–';
    if (v === 0) return '0';
    const size = Math.floor(Math.log10(Math.abs(v)));
    const text = size < -4 || size > 5 ? v.toExponential(1) : v.toFixed(Math.max(0, Math.min(6, 2 - size)));
    return text.replace('-', '−');
  }
  const tick = v => (v === 0 ? '0' : Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5 ? v.toExponential(0) : String(+v.toPrecision(6))).replace('-', '−');

  // A logarithmic scale that begins between two marks has one at its edge.
  const isRound = v => Math.abs(+v.toPrecision(1) / v - 1) < 1e-6;

  // Below this nothing is measured by anything; uPlot looks for ever for the steps of a logarithmic grid near 1e-22.
  const LEAST = 1e-15;
  const decent = (u, min, max) => (min == null ? [null, null] : uPlot.rangeLog(Math.max(min, LEAST), Math.max(max, 10 * LEAST), 10, false));
  // As far as there is something, with room for its points.
  const beside = (u, min, max) => (min == null ? [null, null] : [Math.max(min, LEAST) / 1.15, Math.max(max, 10 * LEAST) * 1.15]);
  const scale = axis => (axis.log ? { distr: 3, range: axis.range || decent } : { time: false, range: axis.range });

  // Over many decades only the decades get a grid line.
  const decades = (u, splits) => (splits.length < 40 ? splits : splits.map(v => (Math.abs(Math.log10(v) - Math.round(Math.log10(v))) < 1e-9 ? v : null)));
  // A time in seconds, two digits: 0.1, 1, 9.8.
  const seconds = t => String(+t.toPrecision(2));

  function axis(a, side) {
    return {
      side, label: a.label + (a.unit ? ` (${a.unit})` : ''), labelSize: 20, labelGap: 0, labelFont: '12px system-ui, sans-serif',
      font: '12px system-ui, sans-serif', size: side === 3 ? 56 : 34, stroke: () => ink('soft'),
      grid: { stroke: () => ink('grid'), width: 1, ...(a.log ? { filter: decades } : {}) }, ticks: { stroke: () => ink('grid'), width: 1, size: 5 },
      values: a.values || ((u, splits) => splits.map(v => (v == null || (a.log && !isRound(v)) ? '' : tick(v)))),
    };
  }

  function line(s) {
    return {
      label: s.label, width: s.width ?? 1.5, dash: s.dash, stroke: () => ink(s.ink), spanGaps: s.spanGaps ?? false,
      points: s.points ? { show: true, size: s.points, fill: () => ink(s.ink), stroke: () => ink(s.ink) } : { show: false },
      paths: s.bare ? () => null : undefined,
      fill: s.fill ? () => ink(s.fill) : undefined,
      value: s.value ? (u, v, k, i) => (i == null ? '–' : `${Math.round(s.value(i))} %`) : (u, v) => (v == null ? '–' : number(v) + (s.unit ? ' ' + s.unit : '')),
    };
  }

  // make(place, { name, x, y, series: [{ label, ink, … }], data: [xs, ys…], bands, height, sync, draw })
  function make(place, spec) {
    place.replaceChildren();
    place.classList.add('chart');
    place.tabIndex = 0;
    place.setAttribute('role', 'img');
    place.setAttribute('aria-label', spec.name);
    const width = () => Math.max(160, Math.floor(place.clientWidth));
    const options = {
      width: width(), height: spec.height || 260, padding: [10, 20, 0, 0],
      scales: { x: scale(spec.x), y: scale(spec.y) },
      axes: [axis(spec.x, 2), axis(spec.y, 3)],
      // A border would keep the colour of the theme in which it was made.
      legend: { live: true, markers: { width: 0 } },
      cursor: { drag: { x: true, y: true, uni: 24 }, points: { size: 7 }, sync: spec.sync ? { key: spec.sync, scales: ['x', null] } : undefined },
      series: [{ label: spec.x.short || spec.x.label, value: (u, v) => (v == null ? '–' : number(v) + (spec.x.unit ? ' ' + spec.x.unit : '')) }, ...spec.series.map(line)],
      bands: (spec.bands || []).map(b => ({ series: b, fill: () => ink('band') })),
      hooks: {
        draw: spec.draw ? [spec.draw] : [],
        setSelect: [], setScale: [],
        // Names alone until a value is pointed at.
        setCursor: [u => place.classList.toggle('hovered', u.cursor.idx != null && u.cursor.left >= 0)],
      },
    };
    const chart = { u: null, zoomed: false, place, spec };
    const plot = new uPlot(options, spec.data, place);
    chart.u = plot;
    spec.series.forEach((s, i) => { if (!s.label) place.querySelectorAll('.u-legend .u-series')[i + 1].style.display = 'none'; });
    const reset = document.createElement('button');
    reset.type = 'button'; reset.className = 'reset'; reset.textContent = 'Whole';
    reset.title = 'Show everything again (0)';
    place.append(reset);

    const mark = on => { chart.zoomed = on; place.classList.toggle('zoomed', on); };
    plot.hooks.setSelect = [u => { if (u.select.width > 1 || u.select.height > 1) mark(true); }];
    chart.whole = () => { mark(false); plot.setData(plot.data, true); };
    chart.set = data => { plot.setData(data, !chart.zoomed); if (chart.zoomed) plot.redraw(); };
    reset.addEventListener('click', chart.whole);
    plot.over.addEventListener('dblclick', () => mark(false));
    zoomByKeys(chart, mark);
    zoomByPinch(chart, mark);
    // A chart in a tab that is not shown has no width.
    const observer = new ResizeObserver(() => { if (place.clientWidth && width() !== plot.width) plot.setSize({ width: width(), height: plot.height }); });
    observer.observe(place);
    chart.destroy = () => { observer.disconnect(); all.delete(chart); plot.destroy(); place.replaceChildren(); };
    all.add(chart);
    legend(chart);
    return chart;
  }

  const forward = (u, key, v) => (u.scales[key].distr === 3 ? Math.log10(v) : v);
  const back = (u, key, v) => (u.scales[key].distr === 3 ? 10 ** v : v);

  // Scales the x range by `factor` about the share `at` of its width, and shifts it by the share `shift`.
  function zoom(u, factor, at, shift) {
    const { min, max } = u.scales.x;
    const a = forward(u, 'x', min), b = forward(u, 'x', max), span = b - a;
    const low = a + at * span - at * span * factor + shift * span;
    u.setScale('x', { min: back(u, 'x', low), max: back(u, 'x', low + span * factor) });
  }

  function zoomByKeys({ u, place, whole }, mark) {
    let index = null;
    place.addEventListener('keydown', event => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const xs = u.data[0];
      const at = index == null ? 0.5 : Math.min(1, Math.max(0, u.valToPos(xs[index], 'x') / u.over.clientWidth));
      if (event.key === '+' || event.key === '=') { zoom(u, 0.6, at, 0); mark(true); }
      else if (event.key === '-') { zoom(u, 1 / 0.6, at, 0); mark(true); }
      else if (event.key === '0' || event.key === 'Escape') { index = null; all.forEach(c => { if (c.u === u) c.whole(); }); }
      else if (event.key === 'ArrowLeft' || event.key === 'ArrowRight') {
        const step = (event.key === 'ArrowRight' ? 1 : -1) * (event.shiftKey ? Math.max(1, Math.round(xs.length / 20)) : 1);
        index = Math.min(xs.length - 1, Math.max(0, (index ?? Math.floor(xs.length / 2)) + step));
        u.setCursor({ left: u.valToPos(xs[index], 'x'), top: u.over.clientHeight / 2 });
      } else return;
      event.preventDefault();
    });
  }

  function zoomByPinch({ u, place }, mark) {
    let last = null;
    const middle = touches => {
      const box = u.over.getBoundingClientRect();
      const [a, b] = [touches[0].clientX - box.left, touches[1].clientX - box.left];
      return { centre: (a + b) / 2 / box.width, spread: Math.max(20, Math.abs(a - b)) / box.width };
    };
    place.addEventListener('touchstart', e => { last = e.touches.length === 2 ? middle(e.touches) : null; }, { passive: true });
    place.addEventListener('touchmove', e => {
      if (e.touches.length !== 2 || !last) return;
      e.preventDefault();
      const now = middle(e.touches);
      zoom(u, last.spread / now.spread, now.centre, last.centre - now.centre);
      mark(true);
      last = now;
    }, { passive: false });
  }

  function themed() {
    inks = {};
    for (const chart of all) { chart.u.redraw(false); legend(chart); }
  }
  // uPlot paints legend markers once; a change of theme paints them again.
  function legend(chart) {
    chart.place.querySelectorAll('.u-legend .u-series').forEach((row, i) => {
      const marker = row.querySelector('.u-marker');
      if (i === 0 || !marker) return;
      const isBand = chart.spec.series[i - 1].ink === 'band', dash = chart.u.series[i].dash && !isBand, shade = chart.u.series[i].stroke(chart.u, i);
      marker.classList.toggle('band', isBand);
      marker.style.background = dash ? `repeating-linear-gradient(90deg, ${shade} 0 4px, transparent 4px 6px)` : shade;
    });
  }
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', themed);

  // A button that goes through: as the system has it, light, dark.
  function themeButton() {
    const button = document.createElement('button');
    const order = ['auto', 'light', 'dark'];
    let at = 0;
    try { at = Math.max(0, order.indexOf(localStorage.getItem('theme'))); } catch { /* a page from disk may have no storage */ }
    const apply = () => {
      if (order[at] === 'auto') delete document.documentElement.dataset.theme; else document.documentElement.dataset.theme = order[at];
      button.textContent = { auto: 'Theme: auto', light: 'Theme: light', dark: 'Theme: dark' }[order[at]];
      themed();
    };
    button.type = 'button';
    button.addEventListener('click', () => {
      at = (at + 1) % 3;
      try { localStorage.setItem('theme', order[at]); } catch { /* as above */ }
      apply();
    });
    apply();
    return button;
  }

  // log axes can't show what is not positive
  const positive = values => values.map(v => (v != null && v > 0 ? v : null));

  // Error curves against the floor. curves: [{ label, tau, error, floor, floor_99 }] in °/s, the judged one at `judged`.
  function errorCurve(place, curves, judged, height, sync) {
    return make(place, { ...errorCurveSpec(curves, judged), height: height || 320, sync });
  }
  function errorCurveSpec(curves, judged) {
    const axis = [...new Set(curves.flatMap(c => c.tau))].sort((a, b) => a - b);
    const on = (c, values) => { const m = new Map(c.tau.map((t, i) => [t, values[i]])); return positive(axis.map(t => m.get(t) ?? null)); };
    const floor = curves[judged] || curves[0];
    const shades = ['before', 'residual', 'unknown', 'soft', 'measured'];
    let other = 0;
    const series = [
      { label: 'floor, 99 % below', ink: 'band', width: 1, dash: [2, 4], unit: '°/s', spanGaps: true },
      { label: 'floor', ink: 'floor', width: 2, dash: [7, 4], unit: '°/s', spanGaps: true },
      ...curves.map((c, i) => ({ label: c.label, ink: i === judged ? 'model' : shades[other++ % shades.length], width: i === judged ? 2.5 : 1.5, points: i === judged ? 6 : 4, unit: '°/s', spanGaps: true })),
    ];
    return {
      name: 'Held-out error against averaging time, with the floor',
      x: { label: 'averaging time τ', short: 'τ', unit: 's', log: true, range: beside },
      y: { label: 'rate error', unit: '°/s', log: true },
      series, bands: [[1, 2]],
      data: [axis, on(floor, floor.floor_99), on(floor, floor.floor), ...curves.map(c => on(c, c.error))],
    };
  }

  // What an error is made of: stacked shares over the averaging time. limit: { tau, parts: [{ name, share }] }, shares in %.
  const PARTS = ['gyro noise', 'bias wander', 'reference noise', 'reference bandwidth', 'timing', 'aliased motion', 'missing effect', 'unattributed',
    'random scale', 'rate noise', 'reversal steps', 'start-stop steps', 'lost motion'];
  function budgetSpec(limit) {
    const sums = [];
    limit.parts.reduce((below, part) => { const sum = below.map((b, i) => b + part.share[i]); sums.push(sum); return sum; }, limit.tau.map(() => 0));
    // The highest first: what lies below it is painted over it. The legend shows each part's own share.
    const order = limit.parts.map((_, k) => k).reverse();
    return {
      name: 'What the error is made of, by averaging time',
      x: { label: 'averaging time τ', short: 'τ', unit: 's', log: true, range: beside },
      y: { label: 'share of the error²', unit: '%', range: () => [0, 100] },
      series: order.map(k => ({ label: limit.parts[k].name, ink: 'part-' + PARTS.indexOf(limit.parts[k].name), fill: 'part-' + PARTS.indexOf(limit.parts[k].name), width: 1, value: i => limit.parts[k].share[i] })),
      data: [limit.tau, ...order.map(k => sums[k])],
    };
  }
  function budget(place, limit, sync) { return make(place, { ...budgetSpec(limit), height: 280, sync }); }

  // Takes all charts away.
  const clear = () => [...all].forEach(chart => chart.destroy());

  return { make, clear, budget, budgetSpec, seconds, errorCurve, errorCurveSpec, number, ink, themeButton, positive, DEGREES };
})();
