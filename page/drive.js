'use strict';
// A vehicle that drives in the page: one worker drives and filters, another learns from the stream. The visitor adds what is missing.
const Drive = (() => {
  const { h, panel } = Parts;
  const { number } = Charts;
  // Times real time; between two looks at the vehicle, ms; seconds that are driven at most at once, and in all.
  const SPEEDS = [1, 4, 16];
  const LOOK = 100, MOST_AT_ONCE = 4, LAST = 900;
  // Seconds that a true error is the mean of.
  const TRUE_OVER = 6;
  // Seconds of driving between two judgements, and between two searches at least; a search looks for what is missing.
  const JUDGED = 2, SEARCHED = 6, FIRST_SEARCH = 12;

  let run = null;
  // What drives; nothing where none does.
  const runs = () => run;

  function begin({ hide, seed, save, again, leave }) {
    end();
    const own = run = {
      hide, seed, save, again, leave, speed: 4, paused: false, steps: [], errors: [], truth: [], marks: [], rows: [], t: 0, judged: 0, searched: 0,
      epoch: 0, news: null, shown: null, busy: '', order: null, notice: null, isOpen: false, before: null, since: performance.now(), filter: null,
    };
    own.vehicle = Clerk.hire(() => {});
    own.learner = Clerk.hire((kind, text) => { if (own === run && kind === 'progress') { own.busy = text; draw(); } });
    frame(own);
    start(own).catch(error => trouble(own, error));
  }

  function end() {
    if (!run) return;
    run.vehicle.end();
    run.learner.end();
    clearTimeout(run.timer);
    run = null;
    document.getElementById('drive').replaceChildren();
  }

  function trouble(own, error) {
    if (own !== run || error instanceof Clerk.Ended) return;
    own.paused = true;
    own.notice = ['bad', error.message];
    draw();
  }

  async function start(own) {
    const { axis, hidden } = await own.vehicle.ask({ do: 'vehicle', hide: own.hide ?? null, seed: own.seed });
    Object.assign(own, { axis, hidden, id: hidden.split(':')[0] });
    await own.learner.ask({ do: 'learner', axis, hidden });
    if (own !== run) return;
    own.last = performance.now();
    draw();
    drives(own).catch(error => trouble(own, error));
    learns(own).catch(error => trouble(own, error));
  }

  const sleep = own => new Promise(done => { own.timer = setTimeout(done, LOOK); });
  const nap = ms => new Promise(done => setTimeout(done, ms));

  // Drives as time goes by; what the machine cannot do in time is left out.
  async function drives(own) {
    while (own === run) {
      await sleep(own);
      const now = performance.now(), seconds = Math.min(MOST_AT_ONCE, own.speed * (now - own.last) / 1000, LAST - own.t);
      own.last = now;
      if (own.paused || own.t >= LAST) { drawState(); continue; }
      const news = await own.vehicle.ask({ do: 'drive', seconds });
      const rows = await own.vehicle.ask({ do: 'take', log: 'rows' });
      if (own !== run) return;
      if (news.t == null) continue;
      own.t = news.t;
      own.rows.push(rows);
      own.steps.push(...news.steps);
      own.steps.splice(0, own.steps.length - 3000);
      own.truth.push(...news.true);
      own.filter = news.filter;
      requestAnimationFrame(() => { if (own === run) { drawState(); drawMotion(); } });
    }
  }

  // Asks the learner again and again; an order of the visitor comes first.
  async function learns(own) {
    while (own === run) {
      const isDue = own.t >= own.judged + JUDGED || (own.t >= LAST && own.judged < own.t);
      if (!own.order && (!isDue || own.paused)) { await nap(LOOK); continue; }
      const files = [['rows', await new Blob(own.rows.splice(0)).arrayBuffer()]];
      own.judged = own.t;
      const search = own.t >= FIRST_SEARCH && own.t >= own.searched + SEARCHED;
      const { order } = own;
      own.order = null;
      if (search && !order) own.searched = own.t;
      let news;
      try { news = await own.learner.ask(order ?? { do: 'learn', search }, files); } catch (error) {
        if (!order || own !== run || error instanceof Clerk.Ended) throw error;
        own.notice = ['warn', error.message];
        own.ordered = own.busy = null;
        draw();
        continue;
      }
      if (own !== run) return;
      own.busy = null;
      await took(own, news, order);
    }
  }

  async function took(own, news, order) {
    if (!news.view) { own.waits = news.waits; draw(); return; }
    own.errors.push(...news.errors.filter(error => error.axis === own.axis));
    own.waits = news.waits;
    if (order) {
      const says = `${order.do === 'add' ? '+' : '−'} ${order.effect}`;
      own.marks.push({ t: news.t, says });
      own.ordered = null;
      own.notice = null;
      own.searched = 0;
      if (order.do === 'add') { own.isOpen = true; own.before = { true: own.truth.at(-1)?.error, since: Infinity }; } else own.before = null;
    }
    own.news = news;
    if (news.model && news.epoch !== own.epoch) {
      own.epoch = news.epoch;
      own.model = news.model;
      await own.vehicle.ask({ do: 'use-model', model: news.model });
      if (order && own.before) own.before.since = own.t;
    }
    draw();
  }

  // ── What is seen. ──

  const button = (label, action, more = '') => h('button' + more, { type: 'button', onclick: action }, label);

  function frame(own) {
    const place = name => own[name] = h('');
    own.state = h('span.pill');
    own.speeds = h('.choices.tight', { role: 'group', 'aria-label': 'Speed' }, SPEEDS.map(times => h('button', { type: 'button', 'aria-pressed': String(times === own.speed), onclick: event => {
      own.speed = times;
      own.speeds.querySelectorAll('button').forEach(other => other.setAttribute('aria-pressed', String(other === event.currentTarget)));
    } }, `${times} ×`)));
    own.pause = button('Pause', () => { own.paused = !own.paused; own.pause.textContent = own.paused ? 'Drive on' : 'Pause'; drawState(); });
    own.verdict = h('section.panel.two-thirds.verdict.unknown', { 'aria-live': 'polite' });
    own.has = h('section.panel.third');
    own.suspects = h('section.panel.third', { id: 'drive-suspects' });
    document.getElementById('drive').replaceChildren(
      h('.driving', own.state, own.speeds, own.pause, button('Another vehicle', own.again), button('Leave', () => { const { leave } = own; end(); Charts.clear(); leave(); })),
      h('.grid', own.verdict, own.has,
        panel('two-thirds', 'Error of the rate over 1 s, while it drives', place('over'), h('p.soft.small', 'Measured: on samples that the fit did not use, beside the reference; floor: what noise alone leaves. True: against the rate itself, which only a simulation knows.')),
        own.suspects,
        panel('', 'Rate: measured by the reference, and computed by the model from the gyro', place('rate'), place('residual')),
        panel('', 'Error against the averaging time', place('curve'), h('p.soft.small', 'Where the curve is above the floor, the model lacks an effect: a fast one at short times (left), a slow one at long times (right).'))));
    own.motion = Live.motion(own.rate, own.residual, () => own.marks);
    own.errorCurve = Live.curve(own.curve);
    draw();
  }

  function drawState() {
    const own = run;
    if (!own) return;
    const [tone, text] = own.notice?.[0] === 'bad' ? ['bad', 'stopped'] : !own.axis ? ['', 'a vehicle is being built'] : own.t >= LAST ? ['', `arrived after ${LAST / 60} min`] : own.paused ? ['warn', `paused at ${own.t.toFixed(0)} s`] : ['good', `drives: ${own.t.toFixed(0)} s`];
    if (own.state.textContent !== text) { own.state.textContent = text; own.state.className = 'pill' + (tone ? '.' + tone : '').replace('.', ' '); }
  }

  function drawMotion() {
    const own = run;
    if (own.axis) own.motion.set(own.steps, 'xyz'.indexOf(own.axis));
    drawErrors(own);
  }

  function drawErrors(own) {
    const measured = own.errors.filter(e => e.error > 0);
    if (!measured.length && !own.truth.length) return;
    const data = uPlot.join([
      [measured.map(e => e.t), measured.map(e => e.error), Charts.positive(measured.map(e => e.floor))],
      [own.truth.map(e => e.t), Charts.positive(own.truth.map(e => e.error))],
    ]);
    own.overTime ??= Charts.make(own.over, {
      name: 'Error of the rate over 1 s, over time', x: { label: 'time', unit: 's' }, y: { label: 'error over 1 s', unit: '°/s', log: true }, height: 300, sync: 'time', draw: Live.marks(() => own.marks, true),
      series: [{ label: 'measured', ink: 'model', width: 2.5, points: 4, unit: '°/s', spanGaps: true }, { label: 'floor', ink: 'floor', width: 2, dash: [7, 4], unit: '°/s', spanGaps: true }, { label: 'true', ink: 'residual', width: 1.5, unit: '°/s', spanGaps: true }], data,
    });
    own.overTime.set(data);
  }

  function order(what, effect) {
    const own = run;
    own.order = { do: what, effect };
    own.ordered = effect;
    own.notice = null;
    draw();
  }

  const spoken = id => id.replaceAll('-', ' ');
  const plain = text => text[0].toUpperCase() + text.slice(1);

  // What was hidden, and whether it was found; known to the visitor once something was added, or when he asks.
  function secret(own, view) {
    const has = own.news?.effects ?? [];
    if (!own.isOpen) return h('p.soft.small', button('Show what is hidden', () => { own.isOpen = true; draw(); }));
    if (has.includes(own.id)) {
      const now = own.truth.at(-1), was = own.before?.true;
      // An error of the last seconds still knows the model before; a drive that was asked for meanwhile, too.
      const isOver = was != null && now.t > own.before.since + 2 * MOST_AT_ONCE + TRUE_OVER;
      return [own.news.found.map(line => h('p.found', h('b', `${plain(line)}.`))),
        isOver ? h('p.small', `True error of the rate over 1 s: ${number(was)} °/s before, ${number(now.error)} °/s now.`) : null];
    }
    const best = view?.suspects[0];
    const named = best && [best.effect, ...best.aliases.map(a => a.id)].includes(own.id);
    return h('p.soft.small', 'Hidden is ', h('code', own.hidden), named ? ': it is named.' : ': it is not in the model.');
  }

  function draw() {
    const own = run;
    if (!own) return;
    drawState();
    const { news } = own, view = news?.view;
    const tone = own.notice ? own.notice[0] : null;
    if (!view) {
      own.verdict.className = `panel two-thirds verdict ${tone ?? 'unknown'}`;
      Live.fill(own.verdict, h('h2.answer', own.notice?.[1] ?? 'An effect is hidden in this gyro. Which one?'), own.notice ? null : h('p', 'The Kalman filter and the learner know the readings and the reference, nothing else. The first judgement comes after some seconds of driving.'), own.waits ? h('p.soft.small', `Waits: ${own.waits}.`) : null);
      Live.fill(own.has, h('h3', 'Model'), h('p.soft', 'No parameters yet.'));
      Live.fill(own.suspects, h('h3', 'What may be missing'), h('p.soft', 'Nothing examined yet.'));
      return;
    }
    const has = news.effects ?? [];
    const best = ['missing-effect', 'ambiguous'].includes(view.verdict) && view.suspects[0];
    const { looking, won } = news;
    const isWon = won && (!best || looking);
    const add = (effect, primary, text) => h('button' + (primary ? '.primary' : '') + (text ? '.large' : ''), { type: 'button', 'data-add': effect, 'data-effect': effect, disabled: own.ordered ? '' : null, onclick: () => order('add', effect) }, text ?? 'Add');
    const way = own.ordered ? h('p.way', h('b', `${plain(spoken(own.ordered))}: `), own.busy || 'asked for', ' …')
      : best && !looking ? h('p.way', add(best.effect, true, `Add ${spoken(best.effect)} to the model`), best.aliases.map(a => [' ', add(a.id, false, `or ${spoken(a.id)}`)])) : null;
    const answer = isWon ? [h('h2.answer', won), looking ? h('p.soft', looking) : h('p', view.headline)]
      : looking ? [h('h2.answer', looking), h('p', h('b', 'So far: '), view.headline)] : Parts.answer(view);
    own.verdict.className = `panel two-thirds verdict ${tone ?? (isWon ? 'good' : looking ? 'unknown' : view.tone)}`;
    Live.fill(own.verdict, own.notice ? h('p', h('b', own.notice[1])) : null, answer, way, secret(own, view),
      h('.figures', Live.figures(view), own.filter?.rate != null ? Live.figure('rate of the Kalman filter', `${number(own.filter.rate)} ± ${number(own.filter.std)} °/s`, 'now, with its standard deviation') : null));
    const fixed = ['scale-factor', 'bias'];
    Live.fill(own.has, h('h3', `Model, epoch ${news.epoch}`),
      h('.chips', has.map(id => h('span.chip' + (fixed.includes(id) ? '.fixed' : ''), { 'data-effect': id }, id, fixed.includes(id) ? null : h('button', { type: 'button', 'data-remove': id, title: `Remove ${id}`, 'aria-label': `Remove ${id}`, onclick: () => order('remove', id) }, '✕')))),
      h('table.values', h('tbody', view.parameters.map(p => h('tr', h('td', { title: p.says }, `${p.effect} `, h('code', p.name)), h('td.number', p.shown))))),
      own.waits ? h('p.soft.small', `Learning waits: ${own.waits}.`) : h('p.soft.small', `Fitted on ${news.t.toFixed(0)} s of driving.`),
      own.model ? button('Save model', () => own.save('model.toml', own.model, 'application/toml')) : null);
    Live.fill(own.suspects, h('h3', 'What may be missing'), view.suspects.length ? view.suspects.map((s, i) => Parts.suspect(s, has.includes(s.effect) ? h('span.pill.good', 'in use') : add(s.effect, !i))) : h('p.soft', view.verdict === 'adequate' ? 'Nothing: the rest is noise.' : 'No suspect stands out yet.'));
    own.errorCurve.set(view, own.marks.length);
    drawErrors(own);
  }

  return { begin, end, runs };
})();
