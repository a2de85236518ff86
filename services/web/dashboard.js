'use strict';
// The live page: takes the stream of news, draws it at most once a frame, and sends orders.
(() => {
  const { h } = Parts;
  const { number } = Charts;
  const $ = id => document.getElementById(id);
  const fill = (id, ...content) => Live.fill($(id), ...content);
  const STEPS = 1200, ERRORS = 1200, VALUES = 600;
  const scene = { steps: [], errors: [], values: [], marks: [], newest: {} };
  let axis = null, heard = 0, moved = 0, open = false;
  // Orders that are not answered yet, and the effect whose trial was ordered last, until the pipeline's next word says how it stands.
  const orders = new Set();
  let ordered = null;
  const dirty = new Set();

  // ---- news ----------------------------------------------------------------------------------------------------
  const push = (list, items, most) => { list.push(...items); if (list.length > most) list.splice(0, list.length - most); };
  const now = name => data => { scene.newest[name] = data; touch(name); };
  const news = {
    whole: data => { Object.assign(scene, data); moved = performance.now(); touch('steps', 'judged', 'values', 'mark', ...Object.keys(data.newest), 'page', 'trial', 'model', 'status', 'stages'); },
    steps: data => {
      if (scene.steps.length && data[0].t <= scene.steps.at(-1).t) scene.steps = [];
      push(scene.steps, data, STEPS); moved = performance.now(); touch('steps');
    },
    judged: data => { push(scene.errors, [data], ERRORS); touch('judged'); },
    values: data => { push(scene.values, [data], VALUES); touch('values'); },
    mark: data => { push(scene.marks, [data], 100); touch('mark', 'judged', 'values'); },
    page: data => { if (ordered?.answered) ordered = null; now('page')(data); }, looking: now('looking'), model: data => { now('model')(data); touch('page'); }, trial: now('trial'), status: now('status'), stages: now('stages'), source: now('source'), found: now('found'),
  };

  let source = null;
  function connect() {
    source?.close();
    source = new EventSource('events');
    source.onopen = () => { open = true; heard = performance.now(); };
    source.onerror = () => {
      open = false;
      pill();
      if (source.readyState === EventSource.CLOSED) setTimeout(connect, 1500);
    };
    for (const [name, take] of Object.entries(news)) {
      source.addEventListener(name, event => { open = true; heard = performance.now(); take(JSON.parse(event.data)); });
    }
  }

  function pill() {
    const age = (performance.now() - moved) / 1000;
    const finished = scene.newest.status?.finished;
    const [tone, text] = !open ? ['bad', 'connection lost, trying again'] : finished ? ['', 'the source has ended'] : !scene.steps.length ? ['warn', 'waiting for samples'] : age > 3 ? ['warn', `no new samples for ${age.toFixed(0)} s`] : ['good', 'live'];
    const link = $('link');
    if (link.textContent !== text) { link.textContent = text; link.className = 'pill' + (tone ? ' ' + tone : ''); }
  }
  setInterval(pill, 500);

  // ---- drawing, once a frame, and only what changed --------------------------------------------------------------
  let asked = false;
  function touch(...names) {
    names.forEach(n => dirty.add(n));
    if (!asked) { asked = true; requestAnimationFrame(draw); }
  }
  const painters = { steps: drawMotion, judged: drawFalling, mark: drawMotion, values: drawHistory, page: drawPage, looking: drawPage, trial: () => { drawTrial(); drawPage(); }, model: drawModel, status: () => { drawStatus(); drawModel(); }, stages: drawStages, source: drawSource, found: drawPage };
  function draw() {
    asked = false;
    chooseAxes();
    const todo = [...dirty];
    dirty.clear();
    for (const name of new Set(todo.map(n => painters[n]).filter(Boolean))) name();
    pill();
  }
  const all = () => touch(...Object.keys(painters));

  // ---- axes ------------------------------------------------------------------------------------------------------
  function present() {
    const found = new Set([...(scene.newest.page?.axes || []), ...(scene.newest.model?.axes || [])].map(a => a.axis));
    const last = scene.steps.at(-1);
    if (last) last.axes.forEach((a, i) => { if (a.model != null && a.measured != null) found.add('xyz'[i]); });
    return ['x', 'y', 'z'].filter(a => found.has(a));
  }
  let shownAxes = '';
  function chooseAxes() {
    const axes = present();
    if (!axes.length) return;
    if (!axes.includes(axis)) {
      // The axis that needs attention most comes first.
      const worst = [...(scene.newest.page?.axes || [])].sort((a, b) => (b.error_over_floor ?? 0) - (a.error_over_floor ?? 0))[0];
      axis = worst?.axis ?? axes[0];
      all();
    }
    const state = axes.join() + axis;
    if (state === shownAxes) return;
    shownAxes = state;
    $('axes').replaceChildren(...(axes.length > 1 ? axes.map(a => h('button', { type: 'button', 'aria-pressed': String(a === axis), 'data-axis': a, 'data-do': 'axis', title: `Axis ${a} (${'xyz'.indexOf(a) + 1})` }, `axis ${a}`)) : []));
  }
  function pick(letter) { if (present().includes(letter)) { axis = letter; all(); } }
  const at = () => 'xyz'.indexOf(axis ?? 'x');
  const ofAxis = list => list?.find(a => a.axis === axis);

  function drawSource() {
    const s = scene.newest.source;
    if (s) $('source').textContent = s.name + (s.instance && s.instance !== 'default' ? ` · ${s.instance}` : '');
  }

  // ---- motion ----------------------------------------------------------------------------------------------------
  const marks = () => scene.marks;
  let motion;
  function drawMotion() {
    (motion ??= Live.motion($('rate'), $('residual'), marks)).set(scene.steps, at());
  }

  // ---- error over time -----------------------------------------------------------------------------------------------
  let falling;
  function drawFalling() {
    const list = scene.errors.filter(e => e.axis === axis && e.ratio > 0);
    if (!list.length) return;
    const data = [list.map(e => e.t), list.map(e => e.ratio), list.map(() => 1), Charts.positive(list.map(e => e.error))];
    falling ??= Charts.make($('falling'), { name: 'Largest error over floor, over time', x: { label: 'time', unit: 's' }, y: { label: 'error / floor', unit: '', log: true, range: (u, min, max) => [0.7, Math.max(3, (max ?? 1) * 1.4)] }, height: 220, sync: 'time', draw: Live.marks(marks, true), series: [{ label: 'largest error / floor', ink: 'model', width: 2, points: 4 }, { label: 'floor', ink: 'floor', width: 2, dash: [7, 4] }, { label: 'error at 1 s', ink: 'residual', bare: true, unit: '°/s' }], data });
    falling.set(data);
  }

  // ---- the diagnosis ---------------------------------------------------------------------------------------------------
  const plain = id => id.replaceAll('-', ' ');
  const adding = (effect, tag, text, key) => h(tag, { type: 'button', 'data-do': 'add', 'data-effect': effect, 'data-axis': axis, title: `Add ${effect} to the model${key}` }, text);
  // The effect on trial on an axis.
  const tried = on => {
    const trial = scene.newest.trial;
    return ordered?.axis === on ? ordered.effect : trial?.state === 'on trial' && [on, 'every'].includes(trial.axis) ? trial.effect : null;
  };
  const trying = effect => h('p.way', h('b', `Trying ${plain(effect)} beside the model in use. `), 'It is taken as soon as it is better on samples that neither model learned from. ', ordered ? null : h('button', { type: 'button', 'data-do': 'undo' }, 'End the trial'));
  const eitherWay = best => h('.way', h('p', 'You can also try each of them: one that is better is taken, and Undo takes it back.'), h('.choices', [best.effect, ...best.aliases.map(a => a.id)].map(id => adding(id, 'button.large', `Try ${plain(id)}`, ''))));
  let curve;
  function drawPage() {
    const view = ofAxis(scene.newest.page?.axes);
    if (!view) return drawTrouble();
    $('verdict').className = `panel two-thirds verdict ${view.tone}`;
    // What the answer asks for is one press away, once it has settled.
    const named = ['missing-effect', 'ambiguous'].includes(view.verdict), best = named && view.suspects[0];
    const looking = scene.newest.looking?.[axis];
    // A judgement may still be of the model before the last change.
    const has = id => ofAxis(scene.newest.model?.axes)?.effects.includes(id);
    // What was won by the last change comes first, as long as nothing more is to be done.
    const trial = scene.newest.trial, won = trial?.says && [axis, 'every'].includes(trial.axis) && has(trial.effect) && (looking || !best || has(best.effect)) ? trial.says : null;
    const way = tried(axis) ? trying(tried(axis)) : won && (!best || has(best.effect)) ? null : best && has(best.effect) ? h('p.way', h('b', `${best.effect} is in the model now. `), 'The next judgement says what that leaves.') : looking || !best ? null : view.verdict === 'missing-effect' ? h('p.way', adding(best.effect, 'button.primary.large', `Add ${plain(best.effect)} to the model`, ' (a)')) : eitherWay(best);
    const then = best && has(best.effect) ? null : h('p', looking ? [h('b', looking), ' '] : null, view.headline);
    const answer = won ? [h('h2.answer', won), (scene.newest.found || []).map(line => h('p', h('b', `${line[0].toUpperCase()}${line.slice(1)}.`))), then] : looking ? [h('h2.answer', looking), h('p', h('b', 'So far: '), view.headline)] : Parts.answer(view);
    if (won) $('verdict').className = `panel two-thirds verdict ${view.tone === 'bad' ? 'bad' : 'good'}`;
    else if (looking) $('verdict').className = 'panel two-thirds verdict unknown';
    fill('verdict', h('p.soft.small', `axis ${axis}`), answer, way,
      h('.figures', Live.figures(view)));
    (curve ??= Live.curve($('curve'))).set(view, scene.marks.length);
    drawLimit(view.limit);
    fill('suspects', h('h3', 'What may be missing'), view.suspects.length ? view.suspects.map((s, i) => Parts.suspect(s, tried(axis) === s.effect ? h('span.pill.warn', 'on trial') : has(s.effect) ? h('span.pill.good', 'in use') : adding(s.effect, i ? 'button' : 'button.primary', 'Add', i ? '' : ' (a)'))) : h('p.soft', view.verdict === 'adequate' ? 'Nothing: the rest is noise.' : 'No suspect stands out yet.'));
    const faults = view.data_faults.length ? [h('h3', 'Data faults'), Parts.list(view.data_faults)] : null;
    fill('fails', h('h3', 'Where it fails'), view.fails_where.length ? Parts.list(view.fails_where) : h('p.soft', 'No regime stands out from the noise.'), faults);
  }
  let limits, limitShape = '';
  function drawLimit(limit) {
    if (!limit?.tau.length) return;
    fill('limit-says', h('b', limit.by), ': ', Parts.prose(limit.says));
    const spec = Charts.budgetSpec(limit);
    // Its legend shows the shares that it was made with.
    const shape = axis + JSON.stringify(limit.parts);
    if (shape === limitShape) return;
    limitShape = shape;
    limits?.destroy();
    limits = Charts.make($('limit'), { ...spec, height: 240, sync: 'tau' });
  }
  // ---- the challenger --------------------------------------------------------------------------------------------------
  let duel, duelShape = '';
  function drawTrial() {
    const trial = scene.newest.trial;
    $('trial-panel').hidden = !trial;
    if (!trial) return;
    const tone = { 'took over': 'good', 'given up': 'bad' }[trial.state] ?? 'warn';
    const times = v => (v == null ? '–' : `${number(v)} × floor`);
    fill('trial-says', h('p', h('b', trial.effect), ` on axis ${trial.axis} `, h('span.pill.' + tone, trial.state), h('span.soft', ` epoch ${trial.epoch}`)),
      h('.figures', [['model in use', trial.present], [`with ${trial.effect}`, trial.other]].map(([of, c]) => h('.figure', h('.of', `largest error, ${of}`), h('.value', times(c.error_over_floor))))));
    if (!trial.other.tau.length) return;
    const curves = [{ ...trial.present, label: 'model in use' }, { ...trial.other, label: `with ${trial.effect}` }];
    const shape = curves.map(c => c.label).join();
    const spec = Charts.errorCurveSpec(curves, 1);
    if (shape !== duelShape) { duel?.destroy(); duel = null; duelShape = shape; }
    if (duel) duel.set(spec.data); else duel = Charts.make($('trial'), { ...spec, name: 'Error of the model in use and of the other one', height: 240, sync: 'tau' });
  }

  // ---- the model ---------------------------------------------------------------------------------------------------------
  function drawModel() {
    const model = scene.newest.model, mine = ofAxis(model?.axes);
    if (!mine) return;
    const chip = id => (id === 'scale-factor' || id === 'bias' ? h('span.chip.fixed', id) : h('span.chip', { 'data-effect': id }, id, h('button', { type: 'button', 'data-do': 'remove', 'data-effect': id, 'data-axis': axis, title: `Remove ${id}`, 'aria-label': `Remove ${id}` }, '✕')));
    fill('model', h('h3', `Model, epoch ${model.epoch}`), h('.chips', mine.effects.map(chip)),
      h('.choices', h('button', { type: 'button', 'data-do': 'undo', title: 'Back to the model before the last change (u)' }, 'Undo'),
        h('button', { type: 'button', 'data-do': model.paused ? 'resume' : 'pause', title: 'Learning on and off (p)' }, model.paused ? 'Resume learning' : 'Pause learning'),
        h('button', { type: 'button', 'data-do': 'forget', title: 'Forget what was seen so far' }, 'Forget')),
      h('p.soft.small', model.paused && scene.newest.status?.learning ? Parts.prose(`Learning ${scene.newest.status.learning}.`) : `Fitted on the motion so far, averaged to ${model.samples.toLocaleString('en')} rows.`),
      h('table.values', h('tbody', mine.parameters.map(p => h('tr', h('td', { title: p.says }, `${p.effect} `, h('code', p.name)), h('td.number', p.shown))))));
  }
  let minis = new Map();
  function drawHistory() {
    const mine = ofAxis(scene.newest.model?.axes);
    if (!mine || !scene.values.length) return;
    const keys = mine.parameters.map(p => p.key);
    if ([...minis.keys()].join() !== keys.join()) {
      minis.forEach(m => m.chart?.destroy());
      minis = new Map(mine.parameters.map(p => [p.key, { p, place: h('') }]));
      $('history').replaceChildren(...[...minis.values()].map(m => h('', h('h3', `${m.p.effect} ${m.p.name}`), m.place)));
    }
    const ts = scene.values.map(v => v.t);
    for (const [key, mini] of minis) {
      const found = scene.values.map(v => v.values.find(x => x[0] === key));
      const bound = sign => found.map(x => (x && x[2] != null ? x[1] + sign * x[2] : x ? x[1] : null));
      const data = [ts, found.map(x => (x ? x[1] : null)), bound(1), bound(-1)];
      const { unit } = mini.p;
      mini.chart ??= Charts.make(mini.place, { name: `${mini.p.effect} ${mini.p.name} over time`, x: { label: 'time', unit: 's' }, y: { label: mini.p.name, unit }, height: 150, sync: 'time', draw: Live.marks(marks, false), bands: [[2, 3]], series: [{ label: mini.p.name, ink: 'model', width: 1.8, unit }, { label: '', ink: 'band', width: 1 }, { label: '', ink: 'band', width: 1 }], data });
      mini.chart.set(data);
    }
  }

  // ---- health ------------------------------------------------------------------------------------------------------------
  const span = ns => (ns >= 1e9 ? `${number(ns / 1e9)} s` : ns >= 1e6 ? `${number(ns / 1e6)} ms` : `${number(ns / 1e3)} µs`);
  // Columns side by side, or, on a phone, each row as a block in which every value has its head beside it.
  const table = (heads, rows) => h('table.values.stacks', h('thead', h('tr', heads.map(head => h('th', head)))),
    h('tbody', rows.map(row => h('tr', row.map((value, i) => h('td' + (typeof value === 'string' && i ? '.number' : ''), { 'data-of': i ? heads[i] : null }, value))))));
  // What keeps the source from being of use comes first: no judgement can follow from it.
  function drawTrouble() {
    const source = scene.newest.status?.source;
    if (!source?.trouble || ofAxis(scene.newest.page?.axes)) return;
    const [first, ...more] = source.trouble.split('\n');
    $('verdict').className = 'panel two-thirds verdict bad';
    fill('verdict', h('h2.answer', first), ...more.map(line => h('p', line)));
    if ($('source').textContent === 'connecting') $('source').textContent = source.says;
  }
  function drawStatus() {
    const status = scene.newest.status;
    if (!status) return;
    drawTrouble();
    const tone = s => ({ running: 'good', failed: 'bad', restarting: 'warn', starting: 'warn' })[s];
    fill('services', h('h3', 'Processes'), status.source && h('p.small' + (status.source.link === 'connected' ? '.soft' : ''), 'Source: ' + status.source.says), h('.scroll', table(['process', 'state', 'restarts', 'taken', 'given', 'lost', 'refused'],
      status.services.map(s => [s.name, h('span.pill' + (tone(s.state) ? '.' + tone(s.state) : ''), s.state), ...[s.restarts, s.received, s.sent, s.lost, s.rejected].map(v => v.toLocaleString('en'))]))));
  }
  function drawStages() {
    const stages = scene.newest.stages;
    if (!stages?.length) return;
    fill('stages', h('h3', 'Latency of each stage'), h('.scroll', table(['stage', 'median', '99 %', '99.9 %', 'worst', ''],
      stages.map(s => {
        const most = Math.max(...s.octaves.map(o => Math.log1p(o[1])), 1);
        const bars = h('.bars', { title: s.octaves.map(([ns, n]) => `${span(ns)}: ${n}`).join('\n') }, s.octaves.map(([, n]) => h('i', { style: `height:${(100 * Math.log1p(n) / most).toFixed(0)}%` })));
        return [s.stage, ...[s.p50_ns, s.p99_ns, s.p999_ns, s.max_ns].map(span), bars];
      }))));
  }

  // ---- orders ------------------------------------------------------------------------------------------------------------
  let clear;
  function notice(tone, text) {
    $('notice').replaceChildren(h(tone ? '.' + tone : '', text));
    clearTimeout(clear);
    clear = setTimeout(() => $('notice').replaceChildren(), tone === 'good' ? 8000 : 40000);
  }
  async function order(body) {
    const key = JSON.stringify(body);
    if (orders.has(key)) return;
    const before = orders.size ? ' once the order before is answered' : '';
    orders.add(key);
    if (body.do === 'add') ordered = { ...body };
    const mine = ordered;
    notice('', { add: `${body.effect}: tried beside the present model${before} …`, undo: `Going back${before} …` }[body.do] || 'Asking the pipeline …');
    touch('page', 'model');
    try {
      const response = await fetch('order', { method: 'POST', headers: { 'content-type': 'application/json' }, body: key });
      const text = await response.text();
      let answer;
      try { answer = JSON.parse(text); } catch { answer = { done: false, says: text }; }
      notice(answer.done ? 'good' : 'bad', answer.says || (answer.done ? 'Done.' : 'Refused.'));
      if (ordered && ordered === mine) { if (answer.done) ordered.answered = true; else ordered = null; }
    } catch {
      ordered = null;
      notice('bad', 'The dashboard does not answer: is the pipeline still running?');
    }
    orders.delete(key);
    touch('page', 'model');
  }
  function act({ do: what, effect, axis: on }) {
    if (what === 'axis') pick(on);
    else if (what === 'add' || what === 'remove') order({ do: what, effect, axis: on });
    else order({ do: what });
  }
  document.addEventListener('click', event => { const button = event.target.closest('[data-do]'); if (button) act(button.dataset); });
  document.addEventListener('keydown', event => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest('input, textarea, select')) return;
    const best = ofAxis(scene.newest.page?.axes)?.suspects[0];
    if (event.key === 'a' && best) order({ do: 'add', effect: best.effect, axis });
    else if (event.key === 'u') order({ do: 'undo' });
    else if (event.key === 'p') order({ do: scene.newest.model?.paused ? 'resume' : 'pause' });
    else if ('123'.includes(event.key)) pick('xyz'[event.key - 1]);
    else return;
    event.preventDefault();
  });
  $('save').addEventListener('submit', event => { event.preventDefault(); order({ do: 'save', argument: $('name').value }); });

  document.querySelector('.bar').append(Charts.themeButton());
  connect();
})();
