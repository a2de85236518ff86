'use strict';
// Lays out one report from the data in the page.
(() => {
  const { h, panel } = Parts;
  const { DEGREES, number } = Charts;
  const page = JSON.parse(document.getElementById('data').textContent);
  const main = document.querySelector('main');
  const human = { 'rad/s': [DEGREES, '°/s'], 'rad/s²': [DEGREES, '°/s²'], rad: [DEGREES, '°'], 1: [1, ''] };
  const unit = si => human[si] || [1, si];
  const degrees = values => values.map(v => (v == null ? null : v * DEGREES));
  const spoken = name => name.replaceAll('-', ' ');
  // Charts are made when their panel is in the page, so that they know their width.
  const later = [];

  document.querySelector('.bar').append(Charts.themeButton());
  const several = page.axes.length > 1;
  page.axes.forEach(axis => section(axis).forEach(node => main.append(node)));
  if (!page.axes.length) main.append(panel('', 'Nothing was examined', h('p', 'No axis has both a gyro column and a reference.')));
  if (page.next.length) main.append(h('.grid', panel('', 'Next', page.next.map(Parts.command))));
  main.append(h('p.soft.small', `truerate ${page.version}. Drag over a chart to zoom, double-click for the whole; on a phone pinch; with the keyboard + − 0 and the arrows.`));
  later.forEach(make => make());
  // Unfolding a closed group draws its charts then.

  function section(axis) {
    const judged = axis.curves[axis.judged];
    const verdict = h('.grid.' + axis.tone, { id: 'axis-' + axis.axis },
      h('section.panel.verdict', h('p.soft.small', `axis ${axis.axis}`), Parts.answer(axis), judged ? figures(axis, judged) : null, several || !page.next.length ? null : Parts.command(page.next[0])));
    return [verdict, limit(axis), curves(axis), suspects(axis), explained(axis), overlay(axis), fails(axis), spectra(axis), model(axis)].filter(Boolean);
  }

  function figures(axis, judged) {
    const at = tau => {
      if (!judged.tau.length || tau < 0.7 * judged.tau[0] || tau > 1.4 * judged.tau.at(-1)) return null;
      const i = judged.tau.reduce((best, t, k) => (Math.abs(Math.log(t / tau)) < Math.abs(Math.log(judged.tau[best] / tau)) ? k : best), 0);
      return h('.figure', h('.of', `error at ${Charts.seconds(judged.tau[i])} s`), h('.value', `${number(judged.error[i])} °/s`), h('.of', `${number(judged.error[i] * judged.tau[i])}° in that time; floor: ${number(judged.floor[i])} °/s`));
    };
    const within = axis.within_floor == null ? '' : axis.within_floor ? 'no more than noise and set-up make' : 'more than noise and set-up make';
    return h('.figures', at(0.1), at(1), at(10), axis.error_over_floor == null ? null : h('.figure', h('.of', 'error at its worst'), h('.value', `${number(axis.error_over_floor)} × floor`), h('.of', within)));
  }

  function curves(axis) {
    if (!axis.curves.length || !axis.curves[0].tau.length) return null;
    const place = h('');
    later.push(() => Charts.errorCurve(place, axis.curves, axis.judged));
    const about = `Floor: what noise and the limits of the set-up alone would leave${axis.floor_source ? ` (${axis.floor_source})` : ''}. The gap between curve and floor is missing physics; where it opens says fast (left) or slow (right).`;
    return h('.grid', panel(axis.steps.length ? 'two-thirds' : '', 'Drift rate over a time τ, on data not used for the fit', place, h('p.soft.small', about)), axis.steps.length ? panel('third', 'Error ÷ floor at its worst, step by step (log scale)', Parts.steps(axis.steps)) : null);
  }

  // What the error is made of, and who shows it at which frequency.
  function limit(axis) {
    const l = axis.limit;
    if (!l || !l.tau.length) return null;
    const [areas, whose] = [h(''), h('')];
    later.push(() => Charts.budget(areas, l));
    later.push(() => Charts.make(whose, { name: 'Whose error it is, by frequency', x: { label: 'frequency', short: 'f', unit: 'Hz', log: true }, y: { label: 'density', unit: '°/s/√Hz', log: true }, height: 280, series: [{ label: 'motion', ink: 'measured', width: 1, unit: '°/s/√Hz' }, { label: 'error', ink: 'residual', width: 1.5, unit: '°/s/√Hz' }, { label: 'of it the reference\'s', ink: 'part-2', width: 1.5, unit: '°/s/√Hz' }, { label: 'of it the gyro\'s', ink: 'part-0', width: 1.5, unit: '°/s/√Hz' }], data: [l.frequency, ...['gyro', 'error', 'of_reference', 'of_gyro'].map(k => Charts.positive(l[k]))] }));
    const says = axis.says.includes(l.says.replace(/\.$/, '')) ? null : h('p', Parts.prose(l.says));
    return h('.grid', panel('half', `What limits this log: ${l.by}`, says, areas, h('p.soft.small', `Share of the error² at each averaging time. Noise of the floor: ${l.floor_from}.`)), l.frequency.length ? panel('half', 'Whose error it is', whose, h('p.soft.small', 'Where a line is missing the motion hides it.')) : null);
  }

  function overlay(axis) {
    const trace = axis.detail?.trace;
    if (!trace?.t.length) return null;
    const [a, b] = [h(''), h('')];
    const sync = 'time-' + axis.axis;
    const x = { label: 'time', unit: 's' };
    later.push(() => Charts.make(a, { name: 'Rate: reference and model over time', x, y: { label: 'rate', unit: '°/s' }, sync, height: 240, series: [{ label: 'measured by the reference', ink: 'measured', width: 3.5, unit: '°/s' }, { label: 'model, from the gyro', ink: 'model', width: 1.3, unit: '°/s' }], data: [trace.t, degrees(trace.measured), degrees(trace.model)] }));
    const chosen = h('.choices');
    let chart;
    const draw = which => {
      chart?.destroy();
      const rate = which === 'rate';
      chart = Charts.make(b, { name: 'Residual over time', x, y: { label: rate ? 'model − measured' : 'angle error', unit: rate ? '°/s' : '°' }, sync, height: 190, series: [{ label: rate ? 'model − measured' : 'angle error, open loop', ink: 'residual', width: 1.3, unit: rate ? '°/s' : '°' }], data: [trace.t, degrees(rate ? trace.residual : trace.angle_error)] });
      [...chosen.children].forEach(c => c.setAttribute('aria-pressed', c.dataset.which === which));
    };
    for (const [which, label] of [['rate', 'Rate'], ['angle', 'Angle, open loop']]) chosen.append(h('button', { type: 'button', 'data-which': which, onclick: () => draw(which) }, label));
    later.push(() => draw('rate'));
    return h('.grid', panel('', 'Model and measurement', a), panel('', 'Residual', chosen, b));
  }

  function fails(axis) {
    const regimes = axis.detail?.regimes || [];
    if (axis.verdict === 'bad-data' || !axis.fails_where.length && !regimes.length) return null;
    const words = axis.fails_where.length ? Parts.list(axis.fails_where) : h('p.soft', 'No regime stands out from the noise.');
    const first = regimes.slice(0, 6), rest = regimes.slice(6);
    const panels = list => h('.panels', list.map(r => { const place = h(''); later.push(() => regime(place, r)); return h('', h('h3', spoken(r.regressor)), place); }));
    const hidden = axis.detail?.hidden_by_bias;
    const note = hidden > 0.1 ? h('p.soft', `A filter with an adaptive bias state (10 s) would hide ${Math.round(100 * hidden)} % of this error's power: its innovations would look better than the rate is.`) : null;
    let more = null;
    if (rest.length) {
      more = h('details', h('summary', `${rest.length} more regimes`));
      more.addEventListener('toggle', () => { if (more.open && more.children.length === 1) { const at = later.length; more.append(panels(rest)); later.slice(at).forEach(make => make()); } });
    }
    return h('.grid', panel('', 'Where it fails', words, note, first.length ? h('p.soft.small', 'Mean error (model − measured) with two standard errors; the regime that explains most comes first.') : null, panels(first), more));
  }

  function regime(place, r) {
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
    const extent = Math.max(...low.map(Math.abs), ...high.map(Math.abs), 1e-9) * 1.1;
    const steps = direction ? { values: (u, splits) => splits.map(v => ({ '-1': 'negative', 0: 'still', 1: 'positive' })[v] ?? ''), range: () => [-1.5, 1.5] } : {};
    Charts.make(place, { name: `Mean error by ${spoken(r.regressor)}`, x: { label: direction ? 'turning' : spoken(r.regressor), short: spoken(r.regressor), unit: direction ? '' : name, ...steps }, y: { label: 'mean error', unit: '°/s', range: (u, min, max) => (u.data[1].length && Math.max(Math.abs(min), Math.abs(max)) <= extent ? [-extent, extent] : [min, max]) }, height: 190, draw: whiskers, series: [{ label: 'mean', ink: 'residual', points: 6, width: 1, unit: '°/s' }], data: [xs, mean] });
  }

  // Why each effect is named or is not, folded.
  function explained(axis) {
    if (!axis.explained.length) return null;
    const tests = e => e.tests.length && h('table.tests', h('tbody', e.tests.map(t =>
      h('tr', h('td', t.mark), h('td', { title: t.asks }, t.name), h('td', t.numbers)))));
    const one = e => h('details', h('summary', h('b', e.effect), ' ' + e.outcome), tests(e) || null);
    return h('.grid', panel('', 'Why each effect is named, or is not', h('.explained', axis.explained.map(one))));
  }

  function suspects(axis) {
    if (!axis.suspects.length) return null;
    return h('.grid', panel('', 'Suspects, likeliest first', h('.suspects', axis.suspects.map(s => Parts.suspect(s)))));
  }

  function spectra(axis) {
    const { spectrum, whiteness, heat_maps } = axis.detail || {};
    if (!spectrum?.frequency.length) return null;
    const [s, a, c] = [h(''), h(''), h('')];
    later.push(() => Charts.make(s, { name: 'Spectrum of error and motion', x: { label: 'frequency', short: 'f', unit: 'Hz', log: true }, y: { label: 'density', unit: '°/s/√Hz', log: true }, height: 280, series: [{ label: 'motion', ink: 'measured', width: 1, unit: '°/s/√Hz' }, { label: 'error', ink: 'residual', width: 1.5, unit: '°/s/√Hz' }, { label: 'floor', ink: 'floor', width: 2, dash: [7, 4], unit: '°/s/√Hz' }], data: [spectrum.frequency, ...['motion', 'error', 'floor'].map(k => Charts.positive(degrees(spectrum[k])))] }));
    const test = (place, name, xs, ys, band) => later.push(() => Charts.make(place, { name, x: { label: 'lag', unit: 's' }, y: { label: 'correlation', unit: '' }, height: 190, series: [{ label: 'correlation', ink: 'residual', width: 1.2, points: 4 }, { label: '99 % band', ink: 'floor', width: 1, dash: [5, 4] }, { label: '', ink: 'floor', width: 1, dash: [5, 4] }], data: [xs, ys, xs.map(() => band), xs.map(() => -band)] }));
    test(a, 'Autocorrelation of the residual', whiteness.lag_s, whiteness.autocorrelation, whiteness.band_99);
    test(c, 'Correlation of the residual with the motion', whiteness.cross_lag_s, whiteness.motion_correlation, whiteness.motion_band_99);
    return h('.grid', panel('half', 'Spectrum', s), heat_maps.length ? panel('half', 'Error ÷ floor by regime and frequency', heat(heat_maps)) : null, panel('half', 'Is the residual white? Its autocorrelation', a), panel('half', 'Does it follow the motion? Correlation with it', c));
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
          grid.append(h('', { style, title: v == null ? 'too few samples' : `${number(rms * DEGREES)} °/s at ${number(map.frequency[j])} Hz${known ? `, ${number(v)} × floor` : ''}` }, v == null ? '' : v >= 9.95 ? Math.round(v) : v.toFixed(1)));
        });
      });
      grid.append(h('.edge', 'Hz'), ...order.map(j => map.frequency[j]).map(f => h('.column', f >= 9.95 ? String(Math.round(f)) : String(+f.toPrecision(2)))));
      place.replaceChildren(grid, h('p.soft.small', `Rows: ${spoken(map.regressor)}${name ? ` in ${name}` : ''}. ${known ? 'Numbers: error ÷ floor.' : 'Numbers: error in °/s.'}`));
      [...choices.children].forEach(b => b.setAttribute('aria-pressed', b.textContent === spoken(map.regressor)));
    };
    maps.forEach(map => choices.append(h('button', { type: 'button', onclick: () => show(map) }, spoken(map.regressor))));
    show(maps[0]);
    return h('', choices, place);
  }

  function model(axis) {
    const noise = axis.noise.length ? h('p.soft.small', axis.noise) : null;
    const faults = axis.data_faults.length ? Parts.list(axis.data_faults) : h('p.soft', 'None found.');
    return h('.grid', panel('two-thirds', 'Parameters', Parts.parameters(axis.parameters, true), noise, axis.effects.map(Parts.card)), panel('third', 'Data faults', faults));
  }
})();
