'use strict';
// Lays out a result: as a page of its own, or in a place of another page.
const Report = (() => {
  const { h, panel } = Parts;
  const { DEGREES, number } = Charts;
  const human = { 'rad/s': [DEGREES, '°/s'], 'rad/s²': [DEGREES, '°/s²'], rad: [DEGREES, '°'], 1: [1, ''] };
  const unit = si => human[si] || [1, si];
  const degrees = values => values.map(v => (v == null ? null : v * DEGREES));
  const spoken = name => name.replaceAll('-', ' ');
  // What is laid out; what another page adds to it; charts, which are made when their panel is in the page, so that they know their width.
  let page, beside, later;

  // The page of a report, from the data in it.
  function open() {
    const data = JSON.parse(document.getElementById('data').textContent);
    const bar = document.querySelector('.bar');
    if (data.product) bar.append(h('button.primary', { type: 'button', onclick: download }, 'Download the new model'));
    bar.append(Charts.themeButton());
    lay(data, document.querySelector('main'));
  }

  // more: { axis(axis) gives what stands in the panel of its verdict, suspect(axis, suspect) what stands behind a suspect's name,
  // shown the axis to begin with }
  function lay(data, main, more = {}) {
    [page, beside, later] = [data, more, []];
    if (page.warning) main.append(h('.grid.warn', h('section.panel.verdict', h('p', page.warning))));
    if (page.story) main.append(h('.grid', panel('', page.story.head[0] === 'axis' ? 'All axes' : 'Side by side', Parts.story(page.story), page.story.faults.length ? h('details', h('summary', 'Data faults of all axes'), Parts.list(page.story.faults)) : null, page.next.length ? Parts.command(page.next[0]) : null)));
    const sections = page.axes.map(axis => h('.axis', { id: 'axis-' + axis.axis }, section(axis)));
    const tabs = page.axes.length > 1 ? Parts.tabs(page.axes.map((axis, i) => ({ label: `axis ${axis.axis}`, says: axis.label.split(': ')[0], tone: axis.tone, place: sections[i] }))) : null;
    main.append(...[tabs, ...sections].filter(Boolean));
    if (!page.axes.length) main.append(panel('', 'Nothing was examined', h('p', 'No axis has both a gyro column and a reference.')));
    if (page.next.length) main.append(h('.grid', panel('', 'Next', page.next.map(Parts.command))));
    main.append(h('p.soft.small.screen', `truerate ${page.version}. Drag over a chart to zoom, double-click for the whole; on a phone pinch; with the keyboard + − 0 and the arrows. A click on a line's name switches it off and on.`));
    // Charts learn their width while every axis is shown; then one axis is left.
    later.forEach(make => make());
    tabs?.show(Math.max(0, page.axes.findIndex(axis => axis.axis === more.shown)));
    // Unfolding a closed group draws its charts then.
  }

  function download() {
    const link = h('a', { href: URL.createObjectURL(new Blob([page.product.text], { type: 'application/toml' })), download: page.product.name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  function section(axis) {
    const judged = axis.curves[axis.judged];
    const verdict = h('.grid.' + axis.tone,
      h('section.panel.verdict', h('p.soft.small', `axis ${axis.axis}`), Parts.answer(axis), judged && axis.figures ? figures(axis, judged) : null, beside.axis?.(axis), page.story || !page.next.length ? null : Parts.command(page.next[0])));
    // Where a model is changed by clicks, what is clicked stands near its error.
    const first = beside.axis ? [curves(axis), suspects(axis), limit(axis)] : [limit(axis), curves(axis), suspects(axis)];
    return [verdict, ...first, explained(axis), overlay(axis), fails(axis), spectra(axis), model(axis)].filter(Boolean);
  }

  // Share of the motion over a time τ that the model tells: 100 % less the error over how much the mean rate over τ varies.
  function fit(axis, tau, error) {
    const trace = axis.detail?.trace;
    if (!trace || trace.t.length < 20 || error == null) return null;
    const step = (trace.t.at(-1) - trace.t[0]) / (trace.t.length - 1), many = Math.max(1, Math.round(tau / step));
    if (tau < 0.8 * step) return null;
    const means = [];
    for (let i = 0; i + many <= trace.measured.length; i += many) {
      const part = trace.measured.slice(i, i + many);
      if (part.every(v => v != null)) means.push(part.reduce((a, b) => a + b, 0) / many);
    }
    if (means.length < 5) return null;
    const mean = means.reduce((a, b) => a + b, 0) / means.length;
    const varies = Math.sqrt(means.reduce((a, v) => a + (v - mean) ** 2, 0) / means.length) * DEGREES;
    if (!(varies > error)) return null;
    const share = 100 * (1 - error / varies);
    return share.toFixed(share > 99.5 ? 2 : 1);
  }

  function figures(axis, judged) {
    const fits = (tau, error) => { const share = fit(axis, tau, error); return share == null ? null : h('.of', { title: 'of how much the mean rate over that time varies, the share that the model explains' }, `the model fits the rate to ${share} %`); };
    const at = tau => {
      if (!judged.tau.length || tau < 0.7 * judged.tau[0] || tau > 1.4 * judged.tau.at(-1)) return null;
      const i = judged.tau.reduce((best, t, k) => (Math.abs(Math.log(t / tau)) < Math.abs(Math.log(judged.tau[best] / tau)) ? k : best), 0);
      return h('.figure', h('.of', `error at ${Charts.seconds(judged.tau[i])} s`), h('.value', `${number(judged.error[i])} °/s`), h('.of', `${number(judged.error[i] * judged.tau[i])}° in that time; floor: ${number(judged.floor[i])} °/s`), fits(judged.tau[i], judged.error[i]));
    };
    const within = axis.within_floor == null ? '' : axis.within_floor ? 'within the range of noise and set-up' : 'above the range of noise and set-up';
    return h('.figures', at(0.1), at(1), at(10), axis.error_over_floor == null ? null : h('.figure', h('.of', 'error at its worst'), h('.value', `${number(axis.error_over_floor)} × floor`), h('.of', within)));
  }

  function curves(axis) {
    if (!axis.curves.length || !axis.curves[0].tau.length) return null;
    const place = h('');
    later.push(() => Charts.errorCurve(place, axis.curves, axis.judged, 320, 'tau'));
    const about = `Floor: what noise and the limits of the set-up alone would leave${axis.floor_source ? ` (${axis.floor_source})` : ''}. Where the curve is above the floor, the model lacks an effect: a fast one at short times (left), a slow one at long times (right).`;
    return h('.grid', panel(axis.steps.length ? 'two-thirds' : '', 'Drift rate over a time τ, on data not used for the fit', place, axis.drift ? h('p', Parts.prose(axis.drift)) : null, h('p.soft.small', about)), axis.steps.length ? panel('third', 'Error ÷ floor at its worst, step by step (log scale)', Parts.steps(axis.steps)) : null);
  }

  // What the error is made of, and who shows it at which frequency.
  function limit(axis) {
    const l = axis.limit;
    if (!l || !l.tau.length) return null;
    const [areas, whose] = [h(''), h('')];
    later.push(() => Charts.budget(areas, l, 'tau'));
    later.push(() => Charts.make(whose, { sync: 'frequency', name: 'Whose error it is, by frequency', x: { label: 'frequency', short: 'f', unit: 'Hz', log: true }, y: { label: 'density', unit: '°/s/√Hz', log: true }, height: 280, series: [{ label: 'motion', ink: 'measured', width: 1, unit: '°/s/√Hz' }, { label: 'error', ink: 'residual', width: 1.5, unit: '°/s/√Hz' }, { label: 'part from the reference', ink: 'part-2', width: 1.5, unit: '°/s/√Hz' }, { label: 'part from the gyro', ink: 'part-0', width: 1.5, unit: '°/s/√Hz' }], data: [l.frequency, ...['gyro', 'error', 'of_reference', 'of_gyro'].map(k => Charts.positive(l[k]))] }));
    const says = h('p', Parts.prose(l.says));
    return h('.grid', panel('half', `${l.head[0].toUpperCase()}${l.head.slice(1)}: ${l.by}`, says, areas, h('p.soft.small', `Share of the error² at each averaging time. The noise behind the floor is ${({ measured: 'measured on this log', assumed: 'taken from data sheets' })[l.floor_from] ?? 'not known'}.`)), l.frequency.length ? panel('half', 'Whose error it is', whose, h('p.soft.small', 'A line has a gap where the motion is too large to separate it.')) : null);
  }

  function overlay(axis) {
    const trace = axis.detail?.trace;
    if (!trace?.t.length) return null;
    const [a, b] = [h(''), h('')];
    const sync = 'time', x = { label: 'time', unit: 's' };
    // Two models have two traces, on times of their own.
    const judged = axis.curves[axis.judged]?.label || 'model';
    const models = [{ label: axis.other_trace ? judged : 'model, from the gyro', ink: 'model', width: 1.3, trace, on: true }];
    if (axis.other_trace?.t.length) models.push({ label: axis.curves[0].label, ink: 'before', width: 1.3, trace: axis.other_trace, on: true });
    const joined = tables => (tables.length > 1 ? uPlot.join(tables) : tables[0]);
    const charts = [];
    later.push(() => { charts[0] = Charts.make(a, { name: 'Rate: reference and model over time', x, y: { label: 'rate', unit: '°/s' }, sync, height: 240, series: [{ label: 'measured by the reference', ink: 'measured', width: 3.5, unit: '°/s' }, ...models.map(m => ({ ...m, unit: '°/s', spanGaps: models.length > 1 }))], data: joined(models.map((m, i) => [m.trace.t, ...(i ? [] : [degrees(m.trace.measured)]), degrees(m.trace.model)])) }); });
    const chosen = h('.choices');
    const draw = which => {
      charts[1]?.destroy();
      const rate = which === 'rate', unit = rate ? '°/s' : '°';
      charts[1] = Charts.make(b, { name: 'Residual over time', x, y: { label: rate ? 'model − measured' : 'angle error', unit }, sync, height: 190, series: models.map((m, i) => ({ label: models.length > 1 ? m.label : rate ? 'model − measured' : 'angle error, open loop', ink: i ? 'before' : 'residual', width: 1.3, unit, spanGaps: models.length > 1 })), data: joined(models.map(m => [m.trace.t, degrees(rate ? m.trace.residual : m.trace.angle_error)])) });
      models.forEach((m, i) => charts[1].u.setSeries(i + 1, { show: m.on }));
      [...chosen.children].forEach(c => c.dataset.which && c.setAttribute('aria-pressed', c.dataset.which === which));
    };
    for (const [which, label] of [['rate', 'Rate'], ['angle', 'Angle, open loop']]) chosen.append(h('button', { type: 'button', 'data-which': which, onclick: () => draw(which) }, label));
    later.push(() => draw('rate'));
    const toggle = (m, i) => h('button', { type: 'button', 'data-model': m.label, 'aria-pressed': 'true', onclick: event => {
      m.on = !m.on;
      event.target.setAttribute('aria-pressed', m.on);
      charts[0].u.setSeries(i + 2, { show: m.on });
      charts[1].u.setSeries(i + 1, { show: m.on });
    } }, m.label);
    const switches = models.length > 1 ? h('.choices.screen', h('span.soft.small', 'Models shown:'), models.map(toggle)) : null;
    return h('.grid', panel('', 'Model and measurement', switches, a), panel('', 'Residual', chosen, b));
  }

  function fails(axis) {
    const regimes = axis.detail?.regimes || [];
    if (axis.verdict === 'bad-data' || !axis.fails_where.length && !regimes.length) return null;
    const words = axis.fails_where.length ? Parts.list(axis.fails_where) : h('p.soft', 'No regime stands out from the noise.');
    const first = regimes.slice(0, 6), rest = regimes.slice(6);
    // One scale for all of them, so that a small error looks small; a bin that is hardly known does not stretch it.
    const bins = regimes.flatMap(r => r.bins);
    const tallest = Math.max(1e-9, ...bins.map(b => Math.abs(b.mean)));
    const extent = 1.1 * DEGREES * Math.max(tallest, ...bins.map(b => Math.min(Math.abs(b.mean) + 2 * b.std_error, 1.6 * tallest)));
    const panels = list => h('.panels', list.map(r => { const place = h(''); later.push(() => regime(place, r, extent)); return h('', h('h3', spoken(r.regressor)), place); }));
    const hidden = axis.detail?.hidden_by_bias;
    const note = hidden > 0.1 ? h('p.soft', `A filter with an adaptive bias state (10 s) would hide ${Math.round(100 * hidden)} % of this error's power: its innovations would look better than the rate is.`) : null;
    let more = null;
    if (rest.length) {
      more = h('details', h('summary', `${rest.length} more regimes`));
      more.addEventListener('toggle', () => { if (more.open && more.children.length === 1) { const at = later.length; more.append(panels(rest)); later.slice(at).forEach(make => make()); } });
    }
    return h('.grid', panel('', 'Where it fails', words, note, first.length ? h('p.soft.small', 'Mean error (model − measured) with two standard errors, all on one scale; the regime that explains most comes first.') : null, panels(first), more));
  }

  function regime(place, r, extent) {
    const [factor, name] = unit(r.unit);
    const direction = r.regressor === 'direction';
    const xs = r.bins.map(b => (b.from + b.to) / 2 * factor);
    const [low, mean, high] = [-2, 0, 2].map(k => r.bins.map(b => (b.mean + k * b.std_error) * DEGREES));
    const whiskers = u => {
      const { ctx } = u;
      ctx.save();
      ctx.beginPath(); ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height); ctx.clip();
      ctx.strokeStyle = Charts.ink('soft'); ctx.lineWidth = devicePixelRatio;
      const zero = u.valToPos(0, 'y', true);
      ctx.setLineDash([4, 4]); ctx.beginPath(); ctx.moveTo(u.bbox.left, zero); ctx.lineTo(u.bbox.left + u.bbox.width, zero); ctx.stroke(); ctx.setLineDash([]);
      ctx.strokeStyle = Charts.ink('residual'); ctx.lineWidth = 1.5 * devicePixelRatio;
      xs.forEach((x, i) => { const at = u.valToPos(x, 'x', true); ctx.beginPath(); ctx.moveTo(at, u.valToPos(low[i], 'y', true)); ctx.lineTo(at, u.valToPos(high[i], 'y', true)); ctx.stroke(); });
      ctx.restore();
    };
    const steps = direction ? { values: (u, splits) => splits.map(v => ({ '-1': 'negative', 0: 'still', 1: 'positive' })[v] ?? ''), range: () => [-1.5, 1.5] } : {};
    Charts.make(place, { name: `Mean error by ${spoken(r.regressor)}`, x: { label: direction ? 'turning' : spoken(r.regressor), short: spoken(r.regressor), unit: direction ? '' : name, ...steps }, y: { label: 'mean error', unit: '°/s', range: (u, min, max) => (u.data[1].length && Math.max(Math.abs(min), Math.abs(max)) <= extent ? [-extent, extent] : [min, max]) }, height: 190, sync: r.regressor === 'time' ? 'time' : undefined, draw: whiskers, series: [{ label: 'mean', ink: 'residual', points: 6, width: 1, unit: '°/s' }], data: [xs, mean] });
  }

  // Why each effect is named or is not, folded.
  function explained(axis) {
    if (!axis.explained.length) return null;
    const tests = e => e.tests.length && h('table.tests', h('tbody', e.tests.map(t =>
      h('tr', h('td', t.mark), h('td', { title: t.asks }, t.name), h('td', t.numbers)))));
    const one = e => h('details', h('summary', h('b', e.effect), ' ' + e.says), h('p.soft.small', e.outcome), tests(e) || null);
    return h('.grid', panel('', 'Why each effect is named, or is not', h('.explained', axis.explained.map(one))));
  }

  function suspects(axis) {
    if (!axis.suspects.length) return null;
    return h('.grid', panel('', axis.suspects_head[0].toUpperCase() + axis.suspects_head.slice(1), h('.suspects', axis.suspects.map(s => Parts.suspect(s, beside.suspect?.(axis, s))))));
  }

  function spectra(axis) {
    const { spectrum, whiteness, heat_maps } = axis.detail || {};
    if (!spectrum?.frequency.length) return null;
    const [s, a, c] = [h(''), h(''), h('')];
    later.push(() => Charts.make(s, { sync: 'frequency', name: 'Spectrum of error and motion', x: { label: 'frequency', short: 'f', unit: 'Hz', log: true }, y: { label: 'density', unit: '°/s/√Hz', log: true }, height: 280, series: [{ label: 'motion', ink: 'measured', width: 1, unit: '°/s/√Hz' }, { label: 'error', ink: 'residual', width: 1.5, unit: '°/s/√Hz' }, { label: 'white noise of gyro and encoder', ink: 'floor', width: 2, dash: [7, 4], unit: '°/s/√Hz' }], data: [spectrum.frequency, ...['motion', 'error', 'floor'].map(k => Charts.positive(degrees(spectrum[k])))] }));
    const test = (place, name, xs, ys, band) => later.push(() => Charts.make(place, { name, x: { label: 'lag', unit: 's' }, y: { label: 'correlation', unit: '' }, height: 190, sync: 'lag', series: [{ label: 'correlation', ink: 'residual', width: 1.2, points: 4 }, { label: '99 % band', ink: 'floor', width: 1, dash: [5, 4] }, { label: '', ink: 'floor', width: 1, dash: [5, 4] }], data: [xs, ys, xs.map(() => band), xs.map(() => -band)] }));
    test(a, 'Autocorrelation of the residual', whiteness.lag_s, whiteness.autocorrelation, whiteness.band_99);
    test(c, 'Correlation of the residual with the motion', whiteness.cross_lag_s, whiteness.motion_correlation, whiteness.motion_band_99);
    return h('.grid', panel('half', 'Spectrum', s), heat_maps.length ? panel('half', 'Error ÷ white noise by regime and frequency', heat(heat_maps)) : null, panel('half', 'Is what is left noise? Autocorrelation of the residual', a, h('p.soft.small', whiteSays(whiteness.autocorrelation, whiteness.band_99, 'In noise, one error says nothing about the next one: the correlation stays within the band.', 'the errors depend on each other. Noise of the reference, a bias that drifts and missing physics all make that'))), panel('half', 'Does the error follow the motion? Correlation of the two', c, h('p.soft.small', whiteSays(whiteness.motion_correlation, whiteness.motion_band_99, 'An error that follows the motion comes from physics that the model lacks. Right of 0 the error is later than the motion.', 'the error follows the motion'))));
  }

  // What a test of whiteness shows, counted: one lag in a hundred of noise lies outside the band.
  function whiteSays(values, band, about, outside) {
    const beyond = values.filter(v => Math.abs(v) > band).length;
    const usual = beyond <= Math.max(1, 0.03 * values.length);
    return `${about} Here ${beyond} of ${values.length} lags lie outside the band in which noise keeps 99 of 100: ${usual ? 'nothing stands out' : outside}.`;
  }

  function heat(maps) {
    const choices = h('.choices'), place = h('');
    const show = map => {
      const [factor, name] = unit(map.unit);
      const known = map.floor.every(f => f != null);
      const values = map.rms.map(row => row.map((v, j) => (v == null ? null : known ? v / map.floor[j] : v * DEGREES)));
      const flat = values.flat().filter(v => v != null && v > 0);
      const [low, high] = known ? [1, Math.max(3, ...flat)] : [Math.min(...flat), Math.max(...flat)];
      // From slow to fast, as in the spectrum.
      const order = map.frequency.map((_, j) => j).sort((a, b) => map.frequency[a] - map.frequency[b]);
      const shade = v => Math.max(0, Math.min(1, Math.log(v / low) / Math.log(high / low)));
      const grid = h('.heat', { style: `grid-template-columns: max-content repeat(${map.frequency.length}, minmax(0, 1fr))` });
      map.rms.forEach((row, i) => {
        grid.append(h('.edge', `${number(map.edges[i] * factor)} … ${number(map.edges[i + 1] * factor)}`));
        order.forEach(j => {
          const [rms, v] = [row[j], values[i][j]];
          const style = v == null ? 'background: var(--faint)' : `background: color-mix(in oklab, var(--excess) ${(8 + 82 * shade(v)).toFixed(0)}%, var(--panel))`;
          grid.append(h('', { style, title: v == null ? 'too few samples' : `${number(rms * DEGREES)} °/s at ${number(map.frequency[j])} Hz${known ? `, ${number(v)} × white noise` : ''}` }, v == null ? '' : v >= 9.95 ? Math.round(v) : v.toFixed(1)));
        });
      });
      grid.append(h('.edge', 'Hz'), ...order.map(j => map.frequency[j]).map(f => h('.column', f >= 9.95 ? String(Math.round(f)) : String(+f.toPrecision(2)))));
      place.replaceChildren(grid, h('p.soft.small', `Rows: ${spoken(map.regressor)}${name ? ` in ${name}` : ''}. ${known ? 'Numbers: error ÷ white noise of gyro and encoder.' : 'Numbers: error in °/s.'}`));
      [...choices.children].forEach(b => b.setAttribute('aria-pressed', b.textContent === spoken(map.regressor)));
    };
    maps.forEach(map => choices.append(h('button', { type: 'button', onclick: () => show(map) }, spoken(map.regressor))));
    show(maps[0]);
    return h('', choices, place);
  }

  function model(axis) {
    const noise = axis.noise.length ? h('p.soft.small', axis.noise) : null;
    const faults = axis.data_faults.length ? Parts.list(axis.data_faults) : h('p.soft', page.story?.faults.length ? 'None but those of all axes, named at the top.' : 'None found.');
    return h('.grid', panel('two-thirds', 'Parameters', Parts.parameters(axis.parameters, true), noise, axis.effects.map(Parts.card)), panel('third', 'Data faults', faults));
  }

  return { open, lay };
})();
