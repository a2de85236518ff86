'use strict';
// What is drawn while something runs, by the dashboard and by the page's vehicle: motion, the error curve with its ghost, figures.
const Live = (() => {
  const { h } = Parts;
  const { number } = Charts;
  // Seconds of motion that are shown.
  const WINDOW = 30;

  // Changes an old tree into a new one, keeping nodes: buttons stay under the finger, unfolded cards stay unfolded.
  function morph(old, fresh) {
    if (old.nodeType !== fresh.nodeType || old.nodeName !== fresh.nodeName || (old.dataset?.effect || '') !== (fresh.dataset?.effect || '')) { old.replaceWith(fresh); return; }
    if (old.nodeType === Node.TEXT_NODE) { if (old.data !== fresh.data) old.data = fresh.data; return; }
    for (const { name, value } of [...fresh.attributes]) if (old.getAttribute(name) !== value) old.setAttribute(name, value);
    for (const { name } of [...old.attributes]) if (!fresh.hasAttribute(name) && !(name === 'open' && old.nodeName === 'DETAILS')) old.removeAttribute(name);
    const [a, b] = [[...old.childNodes], [...fresh.childNodes]];
    b.forEach((node, i) => { if (i < a.length) morph(a[i], node); else old.append(node); });
    a.slice(b.length).forEach(node => node.remove());
  }
  function fill(old, ...content) {
    const fresh = old.cloneNode(false);
    fresh.append(...content.flat(9).filter(Boolean));
    morph(old, fresh);
  }

  // Lines where the model changed. list() gives [{ t, says }]; `label`: with what changed.
  const marks = (list, label) => u => {
    const { ctx } = u;
    ctx.save();
    ctx.strokeStyle = Charts.ink('unknown'); ctx.fillStyle = Charts.ink('unknown');
    ctx.setLineDash([]); ctx.lineWidth = devicePixelRatio; ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    for (const [k, mark] of list().entries()) {
      const x = u.valToPos(mark.t, 'x', true);
      if (x < u.bbox.left || x > u.bbox.left + u.bbox.width) continue;
      ctx.beginPath(); ctx.moveTo(x, u.bbox.top); ctx.lineTo(x, u.bbox.top + u.bbox.height); ctx.stroke();
      if (label) {
        const right = x + ctx.measureText(mark.says).width + 8 > u.bbox.left + u.bbox.width;
        ctx.textAlign = right ? 'right' : 'left';
        ctx.fillText(mark.says, x + (right ? -4 : 4) * devicePixelRatio, u.bbox.top + (12 + 14 * (k % 3)) * devicePixelRatio);
      }
    }
    ctx.restore();
  };

  // A symmetric range that grows at once and shrinks slowly: no jitter from one update to the next.
  function calm(least) {
    let held = least;
    return (u, min, max) => {
      const most = Math.max(least, Math.abs(min ?? 0), Math.abs(max ?? 0)) * 1.1;
      held = most > held || most < 0.5 * held ? most : held;
      return [-held, held];
    };
  }

  // Measured rate, the model's rate and their difference over the last half minute. set(steps, i): steps of the program, the axis.
  function motion(ratePlace, residualPlace, list) {
    let rate, residual, all = [];
    const range = () => { const [first, end] = [all[0]?.t ?? 0, all.at(-1)?.t ?? 0]; return [Math.max(first, end - WINDOW), Math.max(end, first + WINDOW)]; };
    return {
      set(steps, i) {
        if (!steps.length) return;
        all = steps;
        const shown = steps.filter(s => s.t >= steps.at(-1).t - 2 * WINDOW);
        const xs = shown.map(s => s.t), of = key => shown.map(s => s.axes[i][key]);
        const x = { label: 'time', unit: 's', range };
        rate ??= Charts.make(ratePlace, { name: 'Rate over the last half minute', x, y: { label: 'rate', unit: '°/s' }, height: 240, sync: 'time', draw: marks(list, true), series: [{ label: 'measured', ink: 'measured', width: 4, unit: '°/s' }, { label: 'model', ink: 'model', width: 1.6, unit: '°/s' }], data: [xs, of('measured'), of('model')] });
        residual ??= Charts.make(residualPlace, { name: 'Residual over the last half minute', x, y: { label: 'residual', unit: '°/s', range: calm(0.02) }, height: 170, sync: 'time', draw: marks(list, false), series: [{ label: 'model − measured', ink: 'residual', width: 1.6, unit: '°/s' }], data: [xs, of('residual')] });
        rate.set([xs, of('measured'), of('model')]);
        residual.set([xs, of('residual')]);
      },
    };
  }

  // The error curve; that before the last change of the model stays as a ghost. set(view, changes): how often the model was changed.
  function curve(place) {
    let chart, made = '', before = null;
    return {
      set(view, changes) {
        const judged = view.curves[view.judged];
        if (!judged?.tau.length) return;
        const of = view.axis + changes;
        if (before?.of !== of) before = { of, last: before?.of?.startsWith(view.axis) ? before.now : null, now: null };
        before.now = { ...judged, label: 'before the last change' };
        const curves = [{ ...judged, label: 'now' }, ...view.curves.slice(1), ...(before.last ? [before.last] : [])];
        const shape = view.axis + curves.map(c => c.label).join();
        const spec = Charts.errorCurveSpec(curves, 0);
        if (shape !== made) { chart?.destroy(); chart = null; made = shape; }
        if (chart) chart.set(spec.data); else chart = Charts.make(place, { ...spec, height: 320, sync: 'tau' });
      },
    };
  }

  const figure = (of, value, below) => h('.figure', h('.of', of), h('.value', value), h('.of', below));
  // The error at 0.1, 1 and 10 s, and where it is worst.
  function figures(view) {
    const judged = view.curves[view.judged];
    const nearest = tau => judged?.tau.length && tau > 0.7 * judged.tau[0] && tau < 1.4 * judged.tau.at(-1) ? judged.tau.reduce((best, t, k) => (Math.abs(Math.log(t / tau)) < Math.abs(Math.log(judged.tau[best] / tau)) ? k : best), 0) : null;
    const at = [0.1, 1, 10].map(nearest).map(k => (k == null ? null : figure(`error at ${Charts.seconds(judged.tau[k])} s`, `${number(judged.error[k])} °/s`, `${number(judged.error[k] * judged.tau[k])}° in that time; floor: ${number(judged.floor[k])} °/s`)));
    return [at, view.error_over_floor == null ? null : figure('error at its worst', `${number(view.error_over_floor)} × floor`, view.within_floor ? 'within the range of noise and set-up' : 'above the range of noise and set-up')];
  }

  return { WINDOW, fill, marks, motion, curve, figure, figures };
})();
